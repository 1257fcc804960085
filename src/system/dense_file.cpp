#include "system/dense_file.hpp"

#include <array>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <set>
#include <string>

#include "io/atomic_file.hpp"
#include "map_file/row_hash.hpp"

namespace ygslam {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::array<char, 8> kMagic = {'Y', 'G', 'D', 'E', 'N', 'S', 'E', '\n'};
constexpr std::uint32_t kFormat = 3;
constexpr std::uint32_t kNamelessFormat = 2;       // the same without the map's identity and sights
constexpr std::uint64_t kLargestRecord = 1 << 30;  // a file with holes may promise anything

struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint32_t format = kFormat;
  std::uint32_t views = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::int32_t width = 0, height = 0;
  MapIdentity map;
  std::uint64_t hash = 0;  ///< of all before

  [[nodiscard]] bool names_map() const { return format != kNamelessFormat; }
  /// In the file, without the hash.
  [[nodiscard]] std::size_t bytes() const {
    return names_map() ? offsetof(Header, hash) : offsetof(Header, map);
  }
  [[nodiscard]] std::uint64_t right_hash() const {
    return map_file::hash_of({reinterpret_cast<const char*>(this), bytes()});
  }
};
static_assert(sizeof(Header) == 80);

struct RecordHeader {
  std::uint64_t bytes = 0;  ///< that follow
  std::uint64_t hash = 0;   ///< of them
};

/// The same of another camera.
Header header_for(const Camera& camera, Header header) {
  header.fx = camera.fx(), header.fy = camera.fy();
  header.cx = camera.cx(), header.cy = camera.cy();
  header.width = camera.width(), header.height = camera.height();
  header.hash = header.right_hash();
  return header;
}

std::string text_of(const Header& h) {
  char text[160];
  std::snprintf(text, sizeof text, "%dx%d fx %g fy %g cx %g cy %g", h.width, h.height, h.fx, h.fy,
                h.cx, h.cy);
  return text;
}

template <typename T>
void put(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Reads values off the front; nothing more once one was not there.
class Parts {
 public:
  explicit Parts(const std::string& bytes) : bytes_(bytes) {}
  template <typename T>
  T take() {
    T value{};
    if (bytes_.size() - at_ < sizeof value) {
      whole_ = false;
    } else {
      std::memcpy(&value, bytes_.data() + at_, sizeof value);
      at_ += sizeof value;
    }
    return value;
  }
  [[nodiscard]] bool whole() const { return whole_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] std::string rest() const { return bytes_.substr(at_); }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
  bool whole_ = true;
};

std::string record_of(const SavedView& saved) {
  std::string bytes;
  put(bytes, index(saved.id.keyframe));
  put(bytes, saved.id.number);
  put(bytes, static_cast<std::uint8_t>(saved.anchor.has_value()));
  if (saved.anchor) {
    put(bytes, index(saved.anchor->keyframe));
    put(bytes, saved.anchor->stamp.ns);
    for (int i = 0; i < 9; ++i) put(bytes, saved.anchor->T_camera_keyframe.R()(i / 3, i % 3));
    for (int i = 0; i < 3; ++i) put(bytes, saved.anchor->T_camera_keyframe.t()[i]);
  }
  put(bytes, saved.stamp.ns);
  put(bytes, static_cast<std::uint16_t>(saved.things.size()));
  for (const ObjectObservation& thing : saved.things) {
    put(bytes, thing.detection.semantic_class);
    put(bytes, thing.detection.score);
    put(bytes, static_cast<std::uint8_t>(thing.is_moving));
    put(bytes, thing.colours);
    put(bytes, static_cast<std::uint32_t>(thing.p_camera.size()));
    for (const Eigen::Vector3f& p : thing.p_camera)
      for (int axis = 0; axis < 3; ++axis) put(bytes, p[axis]);
  }
  put(bytes, static_cast<std::uint16_t>(saved.view->objects().size()));
  for (const SceneObjectId object : saved.view->objects()) put(bytes, object);
  return bytes + saved.view->packed();
}

/// @return what is wrong; empty if nothing.
std::string parse_thing(Parts& parts, ObjectObservation& thing) {
  constexpr float kFarthest_m = 100;
  thing.detection.semantic_class = parts.take<SemanticClass>();
  thing.detection.score = parts.take<float>();
  const auto is_moving = parts.take<std::uint8_t>();
  thing.colours = parts.take<ColourCounts>();
  const auto points = parts.take<std::uint32_t>();
  if (parts.left() / sizeof(Eigen::Vector3f) < points) return "cut short";
  const SemanticClass named = thing.detection.semantic_class;
  if (named > SemanticClass::kCeiling && named != SemanticClass::kUnknown) return "no such class";
  if (!(thing.detection.score >= 0 && thing.detection.score <= 1)) return "no such score";
  if (is_moving > 1) return "neither moves nor stands";
  thing.is_moving = is_moving == 1;
  thing.p_camera.resize(points);
  for (Eigen::Vector3f& p : thing.p_camera) {
    for (int axis = 0; axis < 3; ++axis) p[axis] = parts.take<float>();
    if (!(p.cwiseAbs().maxCoeff() < kFarthest_m)) return "a point is nowhere";
  }
  return {};
}

/// @return nothing where it is no pose.
std::optional<DenseAnchor> parse_anchor(Parts& parts) {
  constexpr double kFarthest_m = 1e6, kExact = 1e-6;
  DenseAnchor anchor;
  anchor.keyframe = KeyframeId{parts.take<std::uint32_t>()};
  anchor.stamp.ns = parts.take<std::int64_t>();
  Mat3 R;
  Vec3 t;
  for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = parts.take<double>();
  for (int i = 0; i < 3; ++i) t[i] = parts.take<double>();
  const bool turns =
      (R * R.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < kExact && R.determinant() > 0;
  if (!parts.whole() || !turns || !(t.cwiseAbs().maxCoeff() < kFarthest_m)) return std::nullopt;
  anchor.T_camera_keyframe = SE3(R, t);
  return anchor;
}

/// @return what is wrong; empty if nothing.
std::string parse_record(const std::string& bytes, const Pinhole& camera, SavedView& saved) {
  Parts parts(bytes);
  saved.id = KeyframeId{parts.take<std::uint32_t>()};
  saved.id.number = parts.take<std::uint32_t>();
  if (parts.take<std::uint8_t>() != 0) {
    saved.anchor = parse_anchor(parts);
    if (!saved.anchor) return "it is nowhere";
  }
  saved.stamp.ns = parts.take<std::int64_t>();
  const int things = parts.take<std::uint16_t>();
  if (things > kMaxDetections) return "more things than a view has";
  for (int i = 0; i < things; ++i)
    if (std::string what = parse_thing(parts, saved.things.emplace_back()); !what.empty())
      return "thing " + std::to_string(i) + ": " + what;
  std::vector<SceneObjectId> objects;
  for (int left = parts.take<std::uint16_t>(); left > 0 && parts.whole(); --left) {
    objects.push_back(parts.take<SceneObjectId>());
    const auto thing = static_cast<std::size_t>(objects.back());
    if (thing < 1 || thing > saved.things.size()) return "shows what is no thing of it";
  }
  if (!parts.whole()) return "cut short";
  auto view = StoredView::from_parts(camera, std::move(objects), parts.rest());
  if (!view) return "its images cannot be unpacked";
  saved.view = std::make_shared<const StoredView>(std::move(*view));
  return {};
}

/// @return what is wrong; empty if nothing.
std::string take_sight(std::string& record, std::uint64_t& sight) {
  if (record.size() < sizeof sight) return "cut short";
  std::memcpy(&sight, record.data(), sizeof sight);
  record.erase(0, sizeof sight);
  return {};
}

Pinhole pinhole_of(const Header& h) { return {h.fx, h.fy, h.cx, h.cy, h.width, h.height}; }

struct Records {
  std::ifstream& file;
  std::uint64_t left;  ///< bytes

  /// @return what is wrong; empty if nothing.
  std::string next(std::string& bytes) {
    RecordHeader record;
    if (!file.read(reinterpret_cast<char*>(&record), sizeof record)) return "cut short";
    left -= sizeof record;
    if (record.bytes > left) return "cut short";
    if (record.bytes > kLargestRecord) return "larger than any";
    bytes.resize(record.bytes);
    if (!file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) return "cut short";
    left -= record.bytes;
    return map_file::hash_of(bytes) == record.hash ? "" : "damaged";
  }
};

Error damaged(const std::filesystem::path& path, const std::string& what) {
  return {ErrorKind::kSavedMap, path.string() + ": " + what};
}

/// @param file to be opened.
Result<Header> read_header(const std::filesystem::path& path, std::ifstream& file) {
  Header header;
  std::error_code code;
  // A pipe that nobody writes to would be waited for.
  if (std::filesystem::exists(path, code) && !std::filesystem::is_regular_file(path, code))
    return damaged(path, "is no regular file");
  file.open(path, std::ios::binary);
  if (!file) return damaged(path, std::strerror(errno));
  const auto read = [&](std::size_t at, std::size_t bytes) {
    return bool(
        file.read(reinterpret_cast<char*>(&header) + at, static_cast<std::streamsize>(bytes)));
  };
  constexpr std::size_t kStart = offsetof(Header, views);
  if (!read(0, kStart) || header.magic != kMagic) return damaged(path, "no dense map of ygslam");
  if (header.format != kFormat && header.format != kNamelessFormat)
    return damaged(path, "format " + std::to_string(header.format) +
                             ", this program reads formats 2 and " + std::to_string(kFormat));
  if (!read(kStart, header.bytes() - kStart) || !read(offsetof(Header, hash), sizeof header.hash) ||
      header.hash != header.right_hash())
    return damaged(path, "damaged header");
  return header;
}

}  // namespace

std::filesystem::path dense_file_of(const std::filesystem::path& map_file) {
  std::error_code code;  // beside the map itself, where a link leads to it
  const bool is_link = std::filesystem::is_symlink(map_file, code);
  const auto map = is_link ? std::filesystem::weakly_canonical(map_file, code) : map_file;
  return (code ? map_file : map).string() + ".dense";
}

Status save_dense_views(const std::filesystem::path& path, const Camera& camera, const Map& map,
                        const std::vector<SavedView>& views) {
  auto file = AtomicFile::create(path);
  if (!file.ok()) return file.error();
  std::string head;
  Header header;
  header.views = static_cast<std::uint32_t>(views.size());
  header.map = map.identity().value_or(MapIdentity{});
  put(head, header_for(camera, header));
  Status written = file->write(head);
  for (const SavedView& view : views) {
    if (!written.ok()) return written;
    std::string record;
    put(record, sight_of(*map.keyframe(tie_of(view).keyframe).data));
    record += record_of(view);
    std::string bytes;
    put(bytes, RecordHeader{record.size(), map_file::hash_of(record)});
    written = file->write(bytes + record);
  }
  return written.ok() ? file->commit() : written;
}

Result<DenseFileInfo> read_dense_info(const std::filesystem::path& path) {
  std::ifstream file;
  const auto header = read_header(path, file);
  if (!header.ok()) return header.error();
  std::error_code code;
  DenseFileInfo info{{}, header->views, std::filesystem::file_size(path, code)};
  if (header->names_map()) info.map = header->map;
  return info;
}

Result<DenseFile> load_dense_views(const std::filesystem::path& path, const Camera& camera) {
  std::ifstream file;
  const auto header = read_header(path, file);
  if (!header.ok()) return header.error();
  if (const Header mine = header_for(camera, *header); mine.hash != header->hash)
    return damaged(
        path, "made with another camera: " + text_of(*header) + ", this one is " + text_of(mine));
  std::error_code code;
  const auto on_disk = std::filesystem::file_size(path, code);
  if (code) return damaged(path, code.message());
  Records records{file, on_disk - header->bytes() - sizeof header->hash};
  DenseFile dense;
  if (header->names_map()) dense.map = header->map;
  std::set<DenseViewId> ids;
  for (std::uint32_t i = 0; i < header->views; ++i) {
    SavedView view;
    std::string bytes;
    std::string what = records.next(bytes);
    if (what.empty() && header->names_map()) what = take_sight(bytes, dense.sights.emplace_back());
    if (what.empty()) what = parse_record(bytes, pinhole_of(*header), view);
    if (what.empty() && !ids.insert(view.id).second) what = "there is one of this number";
    if (!what.empty()) return damaged(path, "view " + std::to_string(i) + ": " + what);
    dense.views.push_back(std::move(view));
  }
  if (records.left != 0) return damaged(path, "more follows than it tells of");
  return dense;
}

}  // namespace ygslam
