#include "app/surface_truth.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <unordered_map>

#include "eval/associate.hpp"
#include "image/depth.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"
#include "io/trajectory_formats.hpp"
#include "io/tum_sequence.hpp"
#include "scene_file/read_surface.hpp"

namespace ygslam {
namespace {

constexpr double kTruthScale = 5000;  // of depth_true and depth_static
constexpr double kFar_m = 4, kCell_m = 0.02;
constexpr float kSameSurface_m = 0.01F;
constexpr std::size_t kStride = 5;
constexpr int kPixelStep = 2, kLeastViews = 3;
constexpr double kMaxDiff_s = 0.005;

// One point for each cube, and how many views have shown it.
class CellPoints {
 public:
  void add(const Eigen::Vector3f& p, int view) {
    const Eigen::Vector3i cell = (p.cast<double>() / kCell_m).array().floor().cast<int>();
    std::uint64_t key = 0;
    for (int i = 0; i < 3; ++i)
      key = key << 21 | (static_cast<std::uint64_t>(cell[i] + (1 << 20)) & 0x1FFFFF);
    const auto [entry, is_new] = index_.try_emplace(key, cells_.size());
    if (is_new) cells_.push_back({p, 0, -1});
    Cell& known = cells_[entry->second];
    if (known.last_view == view) return;
    known.last_view = view;
    ++known.views;
  }

  [[nodiscard]] std::vector<Eigen::Vector3f> points(int least_views) const {
    std::vector<Eigen::Vector3f> points;
    for (const Cell& cell : cells_)
      if (cell.views >= least_views) points.push_back(cell.point);
    return points;
  }

 private:
  struct Cell {
    Eigen::Vector3f point;
    int views = 0, last_view = -1;
  };
  std::unordered_map<std::uint64_t, std::size_t> index_;
  std::vector<Cell> cells_;  // in the order they were met
};

Result<DepthImage> read_true_depth(const std::filesystem::path& file, const ImageSize& size) {
  const auto bytes = read_file(file, std::size_t{64} << 20);
  if (!bytes.ok()) return bytes.error();
  const auto raw = decode_depth(*bytes, size);
  if (!raw.ok()) return Error{raw.error().kind, file.string() + ": " + raw.error().message};
  return depth_from_raw(*raw, kTruthScale, {0.0, 1000.0});
}

struct TruePoints {
  CellPoints seen, movers;
};

void add_view(const DepthImage& visible_m, const DepthImage& fixed_m, const Camera& camera,
              const SE3& T_world_camera, int view, TruePoints& points) {
  for (int v = 0; v < visible_m.height(); v += kPixelStep) {
    for (int u = 0; u < visible_m.width(); u += kPixelStep) {
      const float depth_m = visible_m.at(u, v), behind_m = fixed_m.at(u, v);
      if (!(depth_m > 0) || static_cast<double>(depth_m) > kFar_m) continue;
      const Vec3 p_camera = camera.unproject(camera.undistort(Vec2(u, v)), depth_m);
      const Eigen::Vector3f p = (T_world_camera * p_camera).cast<float>();
      const bool hides = behind_m <= 0 || behind_m - depth_m > kSameSurface_m;
      (hides ? points.movers : points.seen).add(p, view);
    }
  }
}

Result<SurfaceTruth> read_folder(const std::filesystem::path& folder) {
  auto surface = read_surface(folder / "static.ply");
  if (!surface.ok()) return surface.error();
  const auto sequence = open_tum_sequence(folder);
  if (!sequence.ok()) return sequence.error();
  const auto poses = read_stamped_trajectory(folder / "groundtruth.txt");
  if (!poses.ok()) return poses.error();
  std::vector<Timestamp> stamps;
  for (const StampedPose& pose : *poses) stamps.push_back(pose.stamp);
  const Camera camera(sequence->camera);
  const ImageSize size{camera.width(), camera.height()};
  TruePoints points;
  for (std::size_t i = 0; i < sequence->pairs.size(); i += kStride) {
    const SequencePair& pair = sequence->pairs[i];
    const StampedPose& pose = (*poses)[nearest_stamps({&pair.stamp, 1}, stamps).front()];
    if (std::abs(static_cast<double>(pose.stamp.ns - pair.stamp.ns)) > kMaxDiff_s * 1e9) continue;
    const std::string name = std::filesystem::path(pair.colour_file).stem().string() + ".png";
    const auto visible_m = read_true_depth(folder / "depth_true" / name, size);
    if (!visible_m.ok()) return visible_m.error();
    const auto fixed_m = read_true_depth(folder / "depth_static" / name, size);
    if (!fixed_m.ok()) return fixed_m.error();
    add_view(*visible_m, *fixed_m, camera, pose.T_world_camera, static_cast<int>(i), points);
  }
  SurfaceTruth truth{std::move(*surface), points.seen.points(kLeastViews), points.movers.points(1)};
  if (truth.seen.empty())
    return Error{ErrorKind::kInput, folder.string() + ": no part of the surface is in three views"};
  return truth;
}

}  // namespace

Status check_area(const Surface& surface, const std::filesystem::path& file) {
  constexpr double kMost = 5e7;  // samples: a few bytes can make a triangle from here to the moon
  const double samples = sample_count(surface, kCell_m);
  if (samples <= kMost) return Ok{};
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), ": has %.3g m^2 of surface; judged are at most %.3g m^2",
                samples * kCell_m * kCell_m, kMost * kCell_m * kCell_m);
  return Error{ErrorKind::kInput, file.string() + text.data()};
}

Result<Surface> read_surface(const std::filesystem::path& file) {
  auto mesh = read_surface_ply(file);
  if (!mesh.ok()) return mesh.error();
  if (mesh->vertices.empty()) return Error{ErrorKind::kInput, file.string() + ": holds no point"};
  Surface surface{{}, std::move(mesh->triangles)};
  surface.points.reserve(mesh->vertices.size());
  for (const SurfacePoint& point : mesh->vertices) surface.points.push_back(point.p_world);
  return surface;
}

Result<SurfaceTruth> read_surface_truth(const std::filesystem::path& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) return read_folder(path);
  auto surface = read_surface(path);
  if (!surface.ok()) return surface.error();
  if (Status fits = check_area(*surface, path); !fits.ok()) return fits.error();
  auto seen = sample_surface(*surface, kCell_m);
  if (seen.empty()) return Error{ErrorKind::kInput, path.string() + ": its triangles have no area"};
  return SurfaceTruth{std::move(*surface), std::move(seen), {}};
}

}  // namespace ygslam
