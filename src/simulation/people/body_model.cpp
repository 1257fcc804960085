#include "simulation/people/body_model.hpp"

#include <cstring>
#include <map>
#include <tuple>

namespace ygslam::sim {

namespace {

constexpr float kUnitsPerMetre = 15000;

/// Reads plain values; remembers if the bytes ran out.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}
  template <typename T>
  T read() {
    T value{};
    if (sizeof(T) > bytes_.size() - at_) {
      failed_ = true;
      return value;
    }
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string text(std::size_t size) {
    std::string value;
    for (std::size_t i = 0; i < size; ++i) {
      if (const char c = read<char>(); c != 0) value += c;
    }
    return value;
  }
  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] bool at_end() const { return at_ == bytes_.size(); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  bool failed_ = false;
};

std::vector<std::uint32_t> twins_of(const std::vector<Vec3f>& points) {
  std::map<std::tuple<float, float, float>, std::uint32_t> first;
  std::vector<std::uint32_t> twin(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Vec3f& p = points[i];
    twin[i] = first.try_emplace({p.x(), p.y(), p.z()}, i).first->second;
  }
  return twin;
}

BodyShape read_shape(ByteReader& reader, std::uint32_t vertices) {
  BodyShape shape;
  shape.name = reader.text(16);
  for (Vec3& joint : shape.joints) {
    for (int k = 0; k < 3; ++k) joint[k] = static_cast<double>(reader.read<float>());
  }
  shape.points.resize(vertices);
  for (Vec3f& p : shape.points) {
    for (int k = 0; k < 3; ++k)
      p[k] = static_cast<float>(reader.read<std::int16_t>()) / kUnitsPerMetre;
  }
  return shape;
}

}  // namespace

Result<BodyModel> parse_bodies(std::string_view bytes) {
  const Error damaged{ErrorKind::kInput, "the baked bodies are damaged"};
  ByteReader reader(bytes);
  if (reader.text(8) != "YGBODY01") return damaged;
  const auto vertices = reader.read<std::uint32_t>();
  const auto triangles = reader.read<std::uint32_t>();
  const auto bones = reader.read<std::uint32_t>();
  const auto shapes = reader.read<std::uint32_t>();
  const auto parts = reader.read<std::uint32_t>();
  if (bones != kBones || vertices == 0 || vertices > 65535 || triangles > 200000 || shapes == 0 ||
      shapes > 100 || parts > 100)
    return damaged;
  BodyModel model;
  for (int& parent : model.parent) {
    reader.text(16);
    parent = reader.read<std::int8_t>();
    reader.text(3);
  }
  for (std::uint32_t i = 0; i < parts; ++i) model.parts.push_back(reader.text(16));
  model.triangles.resize(triangles);
  for (Triangle& triangle : model.triangles) {
    for (std::uint32_t& corner : triangle.corner) {
      corner = reader.read<std::uint16_t>();
      if (corner >= vertices) return damaged;
    }
    triangle.material = reader.read<std::uint16_t>();
    if (triangle.material >= parts) return damaged;
  }
  model.uv.resize(vertices);
  for (Vec2f& uv : model.uv) uv = {reader.read<float>(), reader.read<float>()};
  model.weights.resize(vertices);
  for (auto& w : model.weights) w.bone = reader.read<std::array<std::uint8_t, 4>>();
  for (auto& w : model.weights) w.share = reader.read<std::array<std::uint8_t, 4>>();
  for (const auto& w : model.weights) {
    for (const std::uint8_t bone : w.bone) {
      if (bone >= kBones) return damaged;
    }
  }
  for (std::uint32_t i = 0; i < shapes; ++i) model.shapes.push_back(read_shape(reader, vertices));
  if (reader.failed() || !reader.at_end()) return damaged;
  model.twin = twins_of(model.shapes[0].points);
  return model;
}

}  // namespace ygslam::sim
