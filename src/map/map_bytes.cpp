#include "map/map_bytes.hpp"

#include <zlib.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace ygslam {
namespace {

constexpr std::uint32_t kMagic = 0x504d4759;  // "YGMP"
constexpr std::uint32_t kSchema = 3;
constexpr double kMostShutterTime_s = 1;
constexpr int kMaxLevels = 32;
static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie");

std::uint32_t checksum(std::span<const char> bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(crc32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

class Writer {
 public:
  template <typename T>
  void number(const T& value) {
    const auto* bytes = reinterpret_cast<const char*>(&value);
    bytes_.append(bytes, sizeof(T));
  }
  template <typename T>
  void count(const T& container) {
    number(static_cast<std::uint32_t>(container.size()));
  }
  void check(bool) {}
  std::string bytes_;
};

/// After a fault everything reads as zero and ok() is false.
class Reader {
 public:
  explicit Reader(std::span<const char> bytes) : bytes_(bytes) {}
  template <typename T>
  void number(T& value) {
    if (sizeof(T) > bytes_.size()) ok_ = false;
    if (!ok_) return;
    std::memcpy(&value, bytes_.data(), sizeof(T));
    bytes_ = bytes_.subspan(sizeof(T));
    if constexpr (std::is_floating_point_v<T>) check(std::isfinite(value));
  }
  /// Each element takes at least one byte: no count asks for more memory than the input is long.
  template <typename T>
  void count(T& container) {
    std::uint32_t n = 0;
    number(n);
    check(n <= bytes_.size());
    if (ok_) container.resize(n);
  }
  void check(bool holds) { ok_ = ok_ && holds; }
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] bool at_end() const { return bytes_.empty(); }

 private:
  std::span<const char> bytes_;
  bool ok_ = true;
};

template <typename Archive, typename Vector>
void coefficients(Archive& archive, Vector& v) {
  for (Eigen::Index i = 0; i < v.size(); ++i) archive.number(v.data()[i]);
}

void pose(Writer& archive, const SE3& T) {
  coefficients(archive, T.R());
  coefficients(archive, T.t());
}
void pose(Reader& archive, SE3& T) {
  Mat3 R = Mat3::Identity();
  Vec3 t = Vec3::Zero();
  coefficients(archive, R);
  coefficients(archive, t);
  archive.check((R.transpose() * R - Mat3::Identity()).norm() < 1e-6 && R.determinant() > 0);
  if (archive.ok()) T = SE3(R, t);
}

template <typename Archive>
void read_out(Archive& archive, auto& r) {  // a ReadOut
  for (auto* time_s :
       {&r.times.colour_readout_s, &r.times.depth_readout_s, &r.times.depth_delay_s}) {
    archive.number(*time_s);
    archive.check(std::abs(*time_s) < kMostShutterTime_s);
  }
  coefficients(archive, r.body_velocity);
  archive.check(r.body_velocity.allFinite());
}

template <typename Archive>
void pose(Archive& archive, auto& T) {  // a PackedPose
  for (auto& q : T.q_xyzw) archive.number(q);
  for (auto& t : T.t) archive.number(t);
  archive.check(std::abs(Eigen::Vector4d(T.q_xyzw.data()).norm() - 1) < 1e-6);
}

template <typename Archive>
void features(Archive& archive, auto& features) {
  archive.count(features.points);
  if constexpr (std::is_same_v<Archive, Reader>) {
    features.descriptors.resize(features.points.size());
  }
  for (std::size_t i = 0; i < features.points.size(); ++i) {
    auto& f = features.points[i];
    coefficients(archive, f.uv_px);
    coefficients(archive, f.ideal_px);
    archive.number(f.depth_m);
    archive.number(f.angle_rad);
    archive.number(f.response);
    archive.number(f.octave);
    std::uint8_t edge = f.on_depth_edge ? 1 : 0;
    archive.number(edge);
    if constexpr (std::is_same_v<Archive, Reader>) f.on_depth_edge = edge != 0;
    for (auto& bits : features.descriptors[i].bits) archive.number(bits);
  }
}

template <typename Archive>
void landmark_fields(Archive& archive, auto& l) {
  archive.number(l.id);
  coefficients(archive, l.p_world);
  coefficients(archive, l.normal_world);
  for (auto& bits : l.descriptor.bits) archive.number(bits);
  archive.number(l.min_distance_m);
  archive.number(l.max_distance_m);
  archive.number(l.first_keyframe);
  archive.number(l.visible);
  archive.number(l.found);
  archive.check(l.visible >= 1 && l.found >= 0 && l.found <= l.visible);
  archive.count(l.observations);
  for (auto& o : l.observations) {
    archive.number(o.keyframe);
    archive.number(o.feature);
  }
}

}  // namespace

/// Reads and writes what Map keeps to itself.
class MapBytes {
 public:
  static void write(Writer& out, const Map& map) {
    out.number(static_cast<std::uint32_t>(map.scales_.levels()));
    out.number(map.scales_.factor());
    out.number(map.next_keyframe_);
    out.number(map.next_landmark_);
    out.number(map.version_);
    out.count(map.keyframes_);
    for (const auto& [id, keyframe] : map.keyframes_) write(out, id, keyframe);
    out.count(map.removed_keyframes_);
    for (const RemovedKeyframe& removed : map.removed_keyframes_) {
      out.number(removed.id);
      out.number(removed.parent);
      pose(out, removed.T_camera_parent);
    }
    std::map<LandmarkId, const Landmark*> sorted;  // the same map gives the same bytes
    for (const auto& [id, landmark] : map.landmarks_) sorted[id] = &landmark;
    out.count(sorted);
    for (const auto& [id, landmark] : sorted) landmark_fields(out, *landmark);
  }

  static std::optional<Map> read(Reader& in, const std::array<double, 4>& bounds) {
    std::uint32_t levels = 0;
    double scale = 0;
    in.number(levels);
    in.number(scale);
    in.check(levels >= 1 && levels <= kMaxLevels && scale > 1 && scale <= 4);
    if (!in.ok()) return std::nullopt;
    Map map({static_cast<int>(levels), scale});
    in.number(map.next_keyframe_);
    in.number(map.next_landmark_);
    std::uint64_t version = 0;
    in.number(version);
    std::uint32_t n = 0;
    in.number(n);
    for (std::uint32_t i = 0; i < n && in.ok(); ++i) read_keyframe(in, bounds, map);
    in.number(n);
    for (std::uint32_t i = 0; i < n && in.ok(); ++i) read_removed(in, map);
    in.number(n);
    for (std::uint32_t i = 0; i < n && in.ok(); ++i) read_landmark(in, map);
    in.check(in.at_end());
    if (in.ok()) check_references(in, map);
    if (!in.ok()) return std::nullopt;
    map.version_ = version;
    return map;
  }

 private:
  static void write(Writer& out, KeyframeId id, const Keyframe& keyframe) {
    out.number(id);
    out.number(keyframe.data->stamp.ns);
    features(out, *keyframe.data->features);
    const DepthImage& nearest_m = keyframe.data->free_space.nearest_m_;
    out.number(static_cast<std::uint32_t>(nearest_m.width()));
    out.number(static_cast<std::uint32_t>(nearest_m.height()));
    for (const float depth_m : nearest_m) out.number(depth_m);
    read_out(out, keyframe.data->read_out);
    pose(out, keyframe.T_camera_world);
    out.number(keyframe.parent);
    for (const float weight : keyframe.static_weight) out.number(weight);
  }

  static void read_keyframe(Reader& in, const std::array<double, 4>& bounds, Map& map) {
    auto data = std::make_shared<KeyframeData>();
    in.number(data->id);
    in.number(data->stamp.ns);
    auto seen = std::make_shared<Features>();
    features(in, *seen);
    for (const Feature& f : seen->points) in.check(f.octave < map.scales_.levels());
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    in.number(width);
    in.number(height);
    in.check(width <= 4096 && height <= 4096);
    if (!in.ok()) return;
    data->free_space.nearest_m_ = DepthImage(static_cast<int>(width), static_cast<int>(height));
    for (float& depth_m : data->free_space.nearest_m_) in.number(depth_m);
    read_out(in, data->read_out);
    SE3 T_camera_world;
    pose(in, T_camera_world);
    KeyframeId parent = kNoKeyframe;
    in.number(parent);
    std::vector<float> weight(seen->size());
    for (float& w : weight) in.number(w);
    in.check(index(data->id) < map.next_keyframe_ && !map.has_keyframe(data->id) &&
             (map.keyframes_.empty() || map.keyframes_.rbegin()->first < data->id));
    if (!in.ok()) return;
    data->features = seen;
    data->grid = FeatureGrid(*seen, bounds);
    const std::uint32_t next = map.next_keyframe_;
    map.next_keyframe_ = index(data->id);
    map.add_keyframe(std::move(data), T_camera_world, parent, std::move(weight));
    map.next_keyframe_ = next;
  }

  static void read_removed(Reader& in, Map& map) {
    RemovedKeyframe removed;
    in.number(removed.id);
    in.number(removed.parent);
    pose(in, removed.T_camera_parent);
    in.check(!map.has_keyframe(removed.id) &&
             (map.removed_keyframes_.empty() || map.removed_keyframes_.back().id < removed.id));
    if (in.ok()) map.removed_keyframes_.push_back(removed);
  }

  static void read_landmark(Reader& in, Map& map) {
    Landmark l;
    landmark_fields(in, l);
    const std::vector<LandmarkObservation> observations = std::move(l.observations);
    in.check(index(l.id) < map.next_landmark_ && !map.has_landmark(l.id) && !observations.empty());
    if (!in.ok()) return;
    l.observations.clear();
    map.landmarks_[l.id] = l;
    for (const LandmarkObservation& o : observations) {
      const auto keyframe = map.keyframes_.find(o.keyframe);
      in.check(keyframe != map.keyframes_.end() && o.feature < keyframe->second.landmarks.size() &&
               map.add_observation(l.id, o.keyframe, o.feature));
      if (!in.ok()) return;
    }
  }

  /// Ways through parents must end: ids grow from parent to child.
  static void check_references(Reader& in, const Map& map) {
    const auto is_before = [&](KeyframeId parent, KeyframeId id) {
      return parent < id && (map.keyframes_.contains(parent) || map.removed(parent) != nullptr);
    };
    for (const auto& [id, keyframe] : map.keyframes_)
      in.check(keyframe.parent == kNoKeyframe || is_before(keyframe.parent, id));
    for (const RemovedKeyframe& removed : map.removed_keyframes_)
      in.check(is_before(removed.parent, removed.id));
  }
};

std::string to_bytes(const Map& map) {
  Writer body;
  MapBytes::write(body, map);
  Writer out;
  out.number(kMagic);
  out.number(kSchema);
  out.number(checksum(body.bytes_));
  return out.bytes_ + body.bytes_;
}

Result<Map> map_from_bytes(std::span<const char> bytes, const std::array<double, 4>& bounds) {
  const auto fault = [](const char* what) {
    return Error{ErrorKind::kSavedMap, std::string("saved map: ") + what};
  };
  std::uint32_t magic = 0;
  std::uint32_t schema = 0;
  std::uint32_t expected = 0;
  Reader header(bytes);
  header.number(magic);
  header.number(schema);
  header.number(expected);
  if (!header.ok() || magic != kMagic) return fault("these bytes are no map");
  if (schema != kSchema) return fault("written by another version of the program");
  const auto body = bytes.subspan(3 * sizeof(std::uint32_t));
  if (checksum(body) != expected) return fault("damaged: the checksum does not match");
  Reader in(body);
  auto map = MapBytes::read(in, bounds);
  if (!map) return fault("damaged: numbers or references without sense");
  return std::move(*map);
}

}  // namespace ygslam
