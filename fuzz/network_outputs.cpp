// What comes out of networks of other makers: shapes of their outputs, numbers, names of classes.
#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "segment/output_decode.hpp"

namespace ygslam::fuzz {
namespace {

class OutputBytes {
 public:
  explicit OutputBytes(std::string_view bytes) : bytes_(bytes) {}
  int next() {
    return position_ < bytes_.size() ? static_cast<unsigned char>(bytes_[position_++]) : 0;
  }
  int below(int limit) { return next() % limit; }
  std::string_view rest() const { return bytes_.substr(position_); }
  /// The rest, over and over.
  std::vector<float> floats(std::size_t count) {
    std::vector<float> values(count, 0.0F);
    const std::string_view source = rest();
    const std::size_t available = source.size() / sizeof(float);
    for (std::size_t i = 0; i < count && available > 0; ++i)
      std::memcpy(&values[i], source.data() + i % available * sizeof(float), sizeof(float));
    return values;
  }

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
};

void check_table(const ClassTable& table) {
  CHECK(std::any_of(table.begin(), table.end(), [](int c) { return c != kNoCocoClass; }));
  for (const int c : table) CHECK(c >= kNoCocoClass && c < kCocoClasses);
}

void names(std::string_view text) {
  for (const ClassNames& found : {parse_python_names(text), parse_rfdetr_names(text)}) {
    for (const auto& [number, name] : found) CHECK(number >= 0 && number < 10000);
    for (const int classes : {0, 3, 80, 91}) {
      const auto table = make_class_table(classes, found);
      if (table.ok()) check_table(*table);
    }
  }
}

void shapes(OutputBytes bytes) {
  constexpr std::array<std::int64_t, 16> kLengths{kOpen, 0,  1,  4,  5,   8,   16,  21,
                                                  32,    38, 80, 91, 116, 300, 384, 1LL << 40};
  constexpr std::array kNames{"", "dets", "labels", "masks", "output0", "\x1b[2J"};
  std::vector<OutputShape> outputs(static_cast<std::size_t>(bytes.below(6)));
  for (OutputShape& output : outputs) {
    output.name = kNames[bytes.below(kNames.size())];
    for (int k = bytes.below(6); k > 0; --k)
      output.lengths.push_back(kLengths[bytes.below(kLengths.size())]);
  }
  const int width = 32 * (1 + bytes.below(2)), height = 32 * (1 + bytes.below(2));
  const auto layout = recognise_outputs(outputs, width, height, parse_python_names(bytes.rest()));
  if (!layout.ok()) {
    CHECK(layout.error().message.find('\n') == std::string::npos);
    CHECK(layout.error().message.find('\x1b') == std::string::npos);
    return;
  }
  check_table(layout->classes);
  for (const int k : layout->order) CHECK(k >= 0 && k < std::ssize(outputs));
}

/// Lengths of a kind's outputs, `rows` of them where it may choose.
std::vector<std::vector<std::size_t>> lengths_of(OutputKind kind, std::size_t width,
                                                 std::size_t height, std::size_t rows) {
  const std::vector<std::size_t> prototypes{1, 32, height / 4, width / 4};
  const auto cells =
      static_cast<std::size_t>(yolo_cells(static_cast<int>(width), static_cast<int>(height)));
  if (kind == OutputKind::kYolo) return {{1, 36 + 80, cells}, prototypes};
  if (kind == OutputKind::kYoloEnd) return {{1, rows, 38}, prototypes};
  if (kind == OutputKind::kRtmdet) return {{1, rows, 5}, {1, rows}, {1, rows, height, width}};
  return {{1, rows, 4}, {1, rows, 80}, {1, rows, 7, 9}};
}

void check_decoded(const Decoded& out, const Letterbox& box) {
  CHECK(out.instances.size() <= 2 * 32);
  for (const Instance& i : out.instances) {
    CHECK(i.class_id >= 0 && i.class_id < kCocoClasses);
    CHECK(i.score > 0 && i.score <= 1);
    CHECK(i.x0 >= 0 && i.x0 < i.x1 && i.x1 <= static_cast<float>(box.image_width));
    CHECK(i.y0 >= 0 && i.y0 < i.y1 && i.y1 <= static_cast<float>(box.image_height));
  }
  for (const std::uint8_t id : out.ids) CHECK(id <= out.instances.size());
}

void decode(OutputBytes bytes) {
  const auto kind = static_cast<OutputKind>(bytes.below(4));
  const int width = 32 * (1 + bytes.below(2)), height = 32 * (1 + bytes.below(2));
  const auto placement = static_cast<Placement>(bytes.below(3));
  const Letterbox box =
      make_letterbox(1 + bytes.below(80), 1 + bytes.below(80), width, height, placement);
  auto lengths = lengths_of(kind, static_cast<std::size_t>(width), static_cast<std::size_t>(height),
                            bytes.below(6));
  if (bytes.below(8) == 7) {  // one of them is another
    auto& wrong = lengths[bytes.below(static_cast<int>(lengths.size()))];
    wrong[bytes.below(static_cast<int>(wrong.size()))] = bytes.below(40);
  }
  DecodeConfig config;
  if (bytes.below(2) == 1) config.classes = {bytes.below(90)};
  config.others = bytes.below(2) == 1;
  std::vector<std::vector<float>> values;
  std::vector<OutputTensor> tensors;
  for (const auto& one : lengths) {
    std::size_t count = 1;
    for (const std::size_t length : one) count *= length;
    values.push_back(bytes.floats(count));
    bytes.next();  // the next tensor's numbers begin elsewhere
  }
  for (std::size_t i = 0; i < lengths.size(); ++i) tensors.push_back({values[i], lengths[i]});
  const OutputLayout layout{kind, {0, 1, lengths.size() == 2 ? 0 : 2}, coco_table()};
  const auto out = decode_outputs(layout, tensors, box, config);
  if (!out.ok()) return;
  check_decoded(*out, box);
  CHECK(mask_cell_px(layout, tensors, box) > 0);
}

}  // namespace

void network_outputs(std::string_view bytes) {
  OutputBytes reader(bytes);
  const int part = reader.below(4);
  if (part == 0) return names(reader.rest());
  if (part == 1) return shapes(reader);
  decode(reader);
}

}  // namespace ygslam::fuzz
