#include "segment/recorded_masks.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/log.hpp"
#include "segment/png_ids.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kTolerance_ns = 1000;
constexpr int kUnknownClass = -1;
constexpr int kMaxId = 255;

Error bad_input(const fs::path& file, const std::string& what) {
  return {ErrorKind::kInput, file.string() + ": " + what};
}

/// "1000.033333" to nanoseconds, exactly, whatever the locale. @return nullopt for anything else.
std::optional<Timestamp> parse_stamp(std::string_view text) {
  const std::size_t dot = std::min(text.find('.'), text.size());
  std::string digits(text.substr(0, dot));
  std::string decimals(dot < text.size() ? text.substr(dot + 1) : std::string_view{});
  decimals.resize(9, '0');
  digits += decimals;
  std::int64_t ns = 0;
  const auto [end, ec] = std::from_chars(digits.data(), digits.data() + digits.size(), ns);
  if (dot == 0 || ec != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return Timestamp{ns};
}

int class_of(const nlohmann::json& value) {
  const auto& names = coco_class_names();
  if (value.is_number_integer()) {
    const auto id = value.get<std::int64_t>();
    return id >= 0 && id < std::ssize(names) ? static_cast<int>(id) : kUnknownClass;
  }
  const auto found = std::find(names.begin(), names.end(), value.get<std::string>());
  return found == names.end() ? kUnknownClass : static_cast<int>(found - names.begin());
}

/// The folder's own instances.json, else that of a rendered sequence whose mask/ it is.
std::optional<fs::path> find_instances(const fs::path& directory) {
  std::error_code ec;
  for (const fs::path& folder : {directory, fs::canonical(directory, ec).parent_path()}) {
    if (fs::exists(folder / "instances.json", ec)) return folder / "instances.json";
  }
  return std::nullopt;
}

}  // namespace

Result<ClassOfId> read_recorded_classes(const fs::path& directory) {
  const auto found = find_instances(directory);
  if (!found) return ClassOfId{};  // 0: person
  std::error_code code;
  if (!fs::is_regular_file(*found, code)) return bad_input(*found, "not a regular file");
  std::ifstream stream(*found);
  return parse_instances({std::istreambuf_iterator<char>(stream), {}}, found->string());
}

namespace {

/// Bounding boxes of the ids in use, ids renumbered without gaps.
Segmentation to_segmentation(GreyImage ids, const ClassOfId& classes) {
  Segmentation out;
  std::array<int, 256> slot;  // index into out.instances
  slot.fill(-1);
  for (int v = 0; v < ids.height(); ++v) {
    for (int u = 0; u < ids.width(); ++u) {
      std::uint8_t& id = ids.at(u, v);
      if (id == 0) continue;
      if (classes[id] == kUnknownClass) {
        id = 0;
        continue;
      }
      const auto x = static_cast<float>(u);
      const auto y = static_cast<float>(v);
      if (slot[id] < 0) {
        slot[id] = static_cast<int>(out.instances.size());
        out.instances.push_back({classes[id], 1.0F, x, y, x + 1, y + 1});
      }
      Instance& instance = out.instances[slot[id]];
      instance.x0 = std::min(instance.x0, x);
      instance.x1 = std::max(instance.x1, x + 1);
      instance.y1 = y + 1;
      id = static_cast<std::uint8_t>(slot[id] + 1);
    }
  }
  out.ids = std::move(ids);
  return out;
}

class RecordedSegmenter final : public Segmenter {
 public:
  RecordedSegmenter(std::map<Timestamp, fs::path> files, fs::path directory,
                    const ClassOfId& classes)
      : files_(std::move(files)), directory_(std::move(directory)), classes_(classes) {}

  Result<Segmentation> segment(const RgbdFrame& frame) override {
    const auto file = files_.lower_bound(Timestamp{frame.stamp.ns - kTolerance_ns});
    if (file == files_.end() || file->first.ns > frame.stamp.ns + kTolerance_ns) {
      return bad_input(directory_, "no mask for frame " + std::to_string(index(frame.id)));
    }
    auto ids = read_png_ids(file->second);
    if (!ids.ok()) return ids.error();
    if (!ids->same_size(frame.colour)) {
      return bad_input(file->second, "is " + size_text(*ids) + ", the colour image is " +
                                         size_text(frame.colour));
    }
    Segmentation out = to_segmentation(std::move(*ids), classes_);
    out.frame = frame.id;
    out.stamp = frame.stamp;
    return out;
  }
  std::string precision() const override { return "recorded"; }

 private:
  template <typename T>
  static std::string size_text(const Image<T>& image) {
    return std::to_string(image.width()) + "x" + std::to_string(image.height());
  }

  std::map<Timestamp, fs::path> files_;
  fs::path directory_;
  ClassOfId classes_;
};

}  // namespace

Result<ClassOfId> parse_instances(const std::string& text, const std::string& name) {
  const auto fault = [&](const std::string& what) {
    return Error{ErrorKind::kInput, name + ": " + what};
  };
  ClassOfId classes{};
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return fault("is not a JSON object of id: class");
  for (const auto& [key, value] : json.items()) {
    int id = 0;
    const auto [end, ec] = std::from_chars(key.data(), key.data() + key.size(), id);
    if (ec != std::errc{} || end != key.data() + key.size() || id < 1 || id > kMaxId) {
      return fault("'" + key.substr(0, 40) + "' is no instance id (1 to 255)");
    }
    if (!value.is_string() && !value.is_number_integer()) {
      return fault("class of instance " + key + " is neither a name nor a number");
    }
    classes[id] = class_of(value);
    if (classes[id] == kUnknownClass) {
      log::warn("{}: instance {} is of no COCO class and is left out", name, id);
    }
  }
  return classes;
}

Result<std::unique_ptr<Segmenter>> make_recorded_segmenter(const fs::path& directory) {
  std::error_code ec;
  std::map<Timestamp, fs::path> files;
  for (auto it = fs::directory_iterator(directory, ec); !ec && it != fs::directory_iterator();
       it.increment(ec)) {
    if (it->path().extension() != ".png") continue;
    if (const auto stamp = parse_stamp(it->path().stem().string())) files[*stamp] = it->path();
  }
  if (ec) return bad_input(directory, "cannot be listed: " + ec.message());
  if (files.empty()) return bad_input(directory, "holds no masks named STAMP.png");
  const auto classes = read_recorded_classes(directory);
  if (!classes.ok()) return classes.error();
  return std::unique_ptr<Segmenter>(
      std::make_unique<RecordedSegmenter>(std::move(files), directory, *classes));
}

}  // namespace ygslam
