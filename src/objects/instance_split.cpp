#include "objects/instance_split.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "objects/quantile.hpp"

namespace ygslam {
namespace {

constexpr double kRecent_s = 0.3;      // who was seen apart longer ago may be anywhere
constexpr double kApart_m = 0.3;       // bodies nearer to each other are one that was taken for two
constexpr double kReach_m = 0.8;       // of a body, from its middle
constexpr double kSamePlace_m = 0.35;  // parts of a body, sideways and in depth
constexpr float kBeside = 0.3F;        // of the lower one's height: more in common is beside it
constexpr std::size_t kMinCells = 12;  // of the thumbnail, in a part ...
constexpr double kMinShare = 0.08;     // ... and of the instance

/// Where a track was expected in the mask's frame.
struct Seed {
  Vec3 centre_cam;
  std::vector<Vec3> cells_cam;
  std::vector<Eigen::Vector2i> cells;  // of the thumbnail
  PixelBox box;                        // about them

  explicit Seed(Vec3 centre) : centre_cam(std::move(centre)) {}
};

/// Sideways and in depth: bodies are upright, and so are most images.
double distance_m(const Vec3& a_cam, const Vec3& b_cam) {
  return std::hypot(a_cam.x() - b_cam.x(), a_cam.z() - b_cam.z());
}

std::vector<Seed> seeds_on(const InstanceView& seen, const ObjectFrame& frame,
                           const Tracks& tracks) {
  std::vector<Seed> seeds;
  if (seen.class_id != kPersonClass) return seeds;  // a chair may be wider than a body
  for (const auto& [key, place] : frame.place) {
    const Track& track = tracks.at(key);
    if (track.id == kNoObject || track.class_id != seen.class_id) continue;
    if (frame.seconds_since(track.seen) > kRecent_s || (place.box & seen.box).empty()) continue;
    seeds.emplace_back(frame.in.T_camera_odom * place.centre_odom);
  }
  return seeds;
}

/// Gives each cell with depth to the track that it lies nearest to.
void assign_cells(const InstanceView& seen, const GreyImage& ids, const Thumbnail& thumbnail,
                  const Camera& camera, std::vector<Seed>& seeds) {
  constexpr int kStep = Thumbnail::kStep;
  const std::set<std::uint8_t> own(seen.ids.begin(), seen.ids.end());
  for (int y = 0; y < thumbnail.depth_m.height(); ++y) {
    for (int x = 0; x < thumbnail.depth_m.width(); ++x) {
      const int u = x * kStep, v = y * kStep;
      const float depth_m = thumbnail.depth_m.at(x, y);
      if (!ids.contains(u, v) || !own.contains(ids.at(u, v)) || !(depth_m > 0)) continue;
      if (!std::isfinite(depth_m)) continue;
      const Vec3 p_cam = camera.unproject(camera.undistort(Vec2(u, v)), depth_m);
      const auto nearest = std::ranges::min_element(
          seeds, {}, [&](const Seed& c) { return distance_m(p_cam, c.centre_cam); });
      if (distance_m(p_cam, nearest->centre_cam) > kReach_m) continue;
      nearest->cells_cam.push_back(p_cam);
      nearest->cells.emplace_back(x, y);
      const auto cell = PixelBox{static_cast<float>(u), static_cast<float>(v),
                                 static_cast<float>(u + kStep), static_cast<float>(v + kStep)};
      nearest->box = nearest->cells.size() == 1 ? cell : nearest->box | cell;
    }
  }
}

/// Drops who has too few cells, or whose cells are no other body's; what they had stays unshared.
void keep_bodies(std::vector<Seed>& seeds) {
  std::size_t all = 0;
  for (const Seed& seed : seeds) all += seed.cells.size();
  std::ranges::stable_sort(seeds, std::greater{}, [](const Seed& c) { return c.cells.size(); });
  std::vector<Seed> bodies;
  for (Seed& seed : seeds) {
    const std::size_t n = seed.cells.size();
    if (n < kMinCells || static_cast<double>(n) < kMinShare * static_cast<double>(all)) continue;
    seed.centre_cam = axis_quantile(seed.cells_cam, 0.5);
    const bool is_apart = std::ranges::all_of(bodies, [&](const Seed& other) {
      return distance_m(seed.centre_cam, other.centre_cam) >= kApart_m;
    });
    if (is_apart) bodies.push_back(std::move(seed));
  }
  seeds = std::move(bodies);
}

void paint(const Seed& seed, const InstanceView& seen, std::uint8_t id, GreyImage& ids) {
  constexpr int kStep = Thumbnail::kStep;
  for (const Eigen::Vector2i& cell : seed.cells)
    for (int v = kStep * cell.y(); v < std::min(kStep * (cell.y() + 1), ids.height()); ++v)
      for (int u = kStep * cell.x(); u < std::min(kStep * (cell.x() + 1), ids.width()); ++u)
        if (std::ranges::find(seen.ids, ids.at(u, v)) != seen.ids.end()) ids.at(u, v) = id;
}

bool is_one_above_the_other(const PixelBox& a, const PixelBox& b) {
  const float common = std::min(a.y1, b.y1) - std::max(a.y0, b.y0);
  return common < kBeside * std::min(a.height(), b.height());
}

/// The track seen a moment ago where an instance is; -1 = none.
int track_at(const InstanceView& seen, const ObjectFrame& frame, const Tracks& tracks) {
  int nearest = -1;
  double least_m = kSamePlace_m;
  const Vec3 centre_cam = frame.in.T_camera_odom * seen.centre_odom;
  for (const auto& [key, place] : frame.place) {
    const Track& track = tracks.at(key);
    if (track.id == kNoObject || track.class_id != seen.class_id) continue;
    if (frame.seconds_since(track.seen) > kRecent_s) continue;
    const double apart_m = distance_m(centre_cam, frame.in.T_camera_odom * place.centre_odom);
    if (apart_m < least_m) least_m = apart_m, nearest = key;
  }
  return nearest;
}

}  // namespace

SplitInstances merge_fragments(SplitInstances seen, const ObjectFrame& frame, const Tracks& tracks,
                               const Camera& camera) {
  std::map<int, InstanceView*> body_of;
  std::vector<InstanceView> bodies;
  bodies.reserve(seen.instances.size());  // body_of points into it
  for (InstanceView& instance : seen.instances) {
    const int key = instance.has_depth ? track_at(instance, frame, tracks) : -1;
    const auto body = key < 0 ? body_of.end() : body_of.find(key);
    if (body == body_of.end() || !is_one_above_the_other(body->second->box, instance.box)) {
      bodies.push_back(std::move(instance));
      if (key >= 0) body_of.emplace(key, &bodies.back());
      continue;
    }
    InstanceView& whole = *body->second;
    const std::set<std::uint8_t> both = [&] {
      std::set<std::uint8_t> ids(whole.ids.begin(), whole.ids.end());
      ids.insert(instance.ids.begin(), instance.ids.end());
      return ids;
    }();
    for (std::uint8_t& id : seen.ids)
      if (both.contains(id)) id = whole.ids.front();
    InstanceView joined;
    joined.class_id = whole.class_id;
    joined.score = std::max(whole.score, instance.score);
    joined.box = whole.box | instance.box;
    joined.ids = {whole.ids.front()};
    (void)measure(joined.ids.front(), seen.ids, frame.in.thumbnail, camera,
                  frame.in.T_camera_odom.inverse(), joined);
    whole = std::move(joined);
  }
  seen.instances = std::move(bodies);
  return seen;
}

SplitInstances split_merged_instances(std::vector<InstanceView> instances, GreyImage ids,
                                      const ObjectFrame& frame, const Tracks& tracks,
                                      const Camera& camera) {
  SplitInstances result{{}, std::move(ids)};
  int last_id = 0;
  for (const std::uint8_t id : result.ids) last_id = std::max<int>(last_id, id);
  const SE3 T_odom_camera = frame.in.T_camera_odom.inverse();
  for (InstanceView& seen : instances) {
    std::vector<Seed> seeds = seeds_on(seen, frame, tracks);
    if (seeds.size() > 1) {
      assign_cells(seen, result.ids, frame.in.thumbnail, camera, seeds);
      keep_bodies(seeds);
    }
    if (seeds.size() < 2 || last_id + std::ssize(seeds) > 255) {
      result.instances.push_back(std::move(seen));
      continue;
    }
    for (const Seed& seed : seeds) {
      InstanceView part;
      part.class_id = seen.class_id;
      part.score = seen.score;
      part.box = seed.box & seen.box;
      part.ids = {static_cast<std::uint8_t>(++last_id)};
      paint(seed, seen, part.ids.front(), result.ids);
      if (measure(part.ids.front(), result.ids, frame.in.thumbnail, camera, T_odom_camera, part))
        result.instances.push_back(std::move(part));
    }
  }
  return result;
}

}  // namespace ygslam
