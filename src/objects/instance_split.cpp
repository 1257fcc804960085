#include "objects/instance_split.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "objects/quantile.hpp"

namespace ygslam {
namespace {

constexpr double kRecent_s = 0.3;      // who was seen apart longer ago may be anywhere
constexpr double kApart_m = 0.3;       // bodies nearer to each other are one that was taken for two
constexpr double kReach_m = 0.8;       // of a body, from its middle
constexpr double kSamePlace_m = 0.35;  // parts of a body, sideways and in depth
constexpr double kWhole_m = 0.15;      // beyond what a body filled before, its parts may reach
constexpr float kBeside = 0.3F;        // of the lower one's height: more in common is beside it
constexpr std::size_t kMinCells = 12;  // of the thumbnail, in a part ...
constexpr double kMinShare = 0.08;     // ... and of the instance
constexpr double kNewcomer_m2 = 0.1;   // facing the camera: less may be an arm or a rim
constexpr double kBody_m2 = 0.15;      // facing the camera: so much is surely a body

/// Where a track was expected in the mask's frame, or where somebody is who is not.
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

/// Calls visit(column, row, point) for the cells of an instance that have depth.
template <typename Visit>
void each_cell(const InstanceView& seen, const GreyImage& ids, const Thumbnail& thumbnail,
               const Camera& camera, const Visit& visit) {
  constexpr int kStep = Thumbnail::kStep;
  const std::set<std::uint8_t> own(seen.ids.begin(), seen.ids.end());
  for (int y = 0; y < thumbnail.depth_m.height(); ++y) {
    for (int x = 0; x < thumbnail.depth_m.width(); ++x) {
      const int u = x * kStep, v = y * kStep;
      const float depth_m = thumbnail.depth_m.at(x, y);
      if (!ids.contains(u, v) || !own.contains(ids.at(u, v)) || !(depth_m > 0)) continue;
      if (!std::isfinite(depth_m)) continue;
      visit(x, y, camera.unproject(camera.undistort(Vec2(u, v)), depth_m));
    }
  }
}

/// Gives each cell with depth to the track that it lies nearest to.
void assign_cells(const InstanceView& seen, const GreyImage& ids, const Thumbnail& thumbnail,
                  const Camera& camera, std::vector<Seed>& seeds) {
  constexpr int kStep = Thumbnail::kStep;
  each_cell(seen, ids, thumbnail, camera, [&](int x, int y, const Vec3& p_cam) {
    const auto nearest = std::ranges::min_element(
        seeds, {}, [&](const Seed& c) { return distance_m(p_cam, c.centre_cam); });
    if (distance_m(p_cam, nearest->centre_cam) > kReach_m) return;
    nearest->cells_cam.push_back(p_cam);
    nearest->cells.emplace_back(x, y);
    const float u = static_cast<float>(x * kStep), v = static_cast<float>(y * kStep);
    const PixelBox cell{u, v, u + kStep, v + kStep};
    nearest->box = nearest->cells.size() == 1 ? cell : nearest->box | cell;
  });
}

/// What lies before all of them and beyond their reach is somebody who comes between, if it is
/// enough of a body. (What lies behind is as often a desk that the network took along.)
void add_newcomer(const InstanceView& seen, const GreyImage& ids, const ObjectFrame& frame,
                  const Camera& camera, std::vector<Seed>& seeds) {
  std::vector<Vec3> beyond_cam;
  each_cell(seen, ids, frame.in.thumbnail, camera, [&](int, int, const Vec3& p_cam) {
    const bool is_near = std::ranges::any_of(
        seeds, [&](const Seed& s) { return distance_m(p_cam, s.centre_cam) <= kReach_m; });
    if (!is_near) beyond_cam.push_back(p_cam);
  });
  if (beyond_cam.size() < kMinCells) return;
  const Vec3 centre_cam = axis_quantile(beyond_cam, 0.5);
  const double cell_m = Thumbnail::kStep * centre_cam.z() / camera.fx();
  if (static_cast<double>(beyond_cam.size()) * cell_m * cell_m < kNewcomer_m2) return;
  const bool is_before =
      std::ranges::all_of(seeds, [&](const Seed& s) { return centre_cam.z() < s.centre_cam.z(); });
  if (is_before) seeds.emplace_back(centre_cam);
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

/// What shows less of a body than that is less sure to be one, however sure the whole was.
float score_of(const InstanceView& part, float whole, const Camera& camera) {
  if (!part.has_depth) return 0;
  const double pixel_m2 = part.depth_m * part.depth_m / (camera.fx() * camera.fy());
  const double area_m2 = part.own_share * part.box.area() * pixel_m2;
  return whole * static_cast<float>(std::min(1.0, area_m2 / kBody_m2));
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

/// Whether an instance lies within what a track was known to fill while nothing hid it.
bool lies_within(const InstanceView& seen, const TrackPlace& place, const Track& track) {
  const Vec3 low = seen.min_odom - place.centre_odom - track.whole_low_m;
  const Vec3 high = seen.max_odom - place.centre_odom - track.whole_high_m;
  return low.minCoeff() > -kWhole_m && high.maxCoeff() < kWhole_m;
}

/// The track seen a moment ago where an instance is; -1 = none.
int track_at(const InstanceView& seen, const ObjectFrame& frame, const Tracks& tracks) {
  int nearest = -1;
  double least_m = std::numeric_limits<double>::infinity();
  const Vec3 centre_cam = frame.in.T_camera_odom * seen.centre_odom;
  for (const auto& [key, place] : frame.place) {
    const Track& track = tracks.at(key);
    if (track.id == kNoObject || track.class_id != seen.class_id) continue;
    if (frame.seconds_since(track.seen) > kRecent_s) continue;
    const double apart_m = distance_m(centre_cam, frame.in.T_camera_odom * place.centre_odom);
    if (apart_m > kSamePlace_m && !lies_within(seen, place, track)) continue;
    if (apart_m < least_m) least_m = apart_m, nearest = key;
  }
  return nearest;
}

bool is_one_body(const InstanceView& a, const InstanceView& b, const TrackPlace& place,
                 const Track& track) {
  return is_one_above_the_other(a.box, b.box) ||
         (lies_within(a, place, track) && lies_within(b, place, track));
}

/// @param ids of the mask; those of b become a's.
InstanceView joined(const InstanceView& a, const InstanceView& b, GreyImage& ids,
                    const ObjectFrame& frame, const Camera& camera) {
  std::set<std::uint8_t> both(a.ids.begin(), a.ids.end());
  both.insert(b.ids.begin(), b.ids.end());
  for (std::uint8_t& id : ids)
    if (both.contains(id)) id = a.ids.front();
  InstanceView whole;
  whole.class_id = a.class_id;
  whole.score = std::max(a.score, b.score);
  whole.box = a.box | b.box;
  whole.ids = {a.ids.front()};
  (void)measure(whole.ids.front(), ids, frame.in.thumbnail, camera,
                frame.in.T_camera_odom.inverse(), whole);
  return whole;
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
    if (body != body_of.end() &&
        is_one_body(*body->second, instance, frame.place.at(key), tracks.at(key))) {
      *body->second = joined(*body->second, instance, seen.ids, frame, camera);
      continue;
    }
    bodies.push_back(std::move(instance));
    if (key >= 0) body_of.emplace(key, &bodies.back());
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
    if (!seeds.empty()) add_newcomer(seen, result.ids, frame, camera, seeds);
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
      part.box = seed.box & seen.box;
      part.ids = {static_cast<std::uint8_t>(++last_id)};
      paint(seed, seen, part.ids.front(), result.ids);
      if (!measure(part.ids.front(), result.ids, frame.in.thumbnail, camera, T_odom_camera, part))
        continue;
      part.score = score_of(part, seen.score, camera);
      result.instances.push_back(std::move(part));
    }
  }
  return result;
}

}  // namespace ygslam
