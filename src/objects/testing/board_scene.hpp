// For tests of objects: frames of things before a wall.
#pragma once

#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"
#include "objects/object_tracker.hpp"

namespace ygslam::testing {

inline constexpr int kPerson = 0;
inline constexpr double kRate_hz = 30;

inline Camera small_camera() { return geometry_test::test_camera(250, 320, 240); }

/// An upright board before a wall, with points on it that stay the same.
struct Thing {
  Vec3 centre = {0, 0, 2};  // in frame 0
  Vec3 velocity_mps = Vec3::Zero();
  Rgb8 colour{200, 30, 30};
  double width_m = 0.4, height_m = 1.2;
  bool in_mask = true;
  float score = 0.9F;
  int points = 60;
  bool same_points = true;  // false: none continues a point of the frame before
};

/// Frames of things before a wall; the camera stands at the origin and looks along z. Masks are
/// exact and come late.
class Scene {
 public:
  static constexpr double kWall_m = 6;
  std::vector<Thing> things;
  int mask_delay = 2;
  bool is_one_instance = false;  // the network takes all of them for one
  double shown = 1;              // of each thing's width, from the left; the rest has no depth

  ObjectInput frame(int k) {
    RgbdFrame image;
    image.colour = ColourImage(camera_.width(), camera_.height(), {90, 90, 90});
    image.depth_m = DepthImage(camera_.width(), camera_.height(), static_cast<float>(kWall_m));
    Segmentation masks;
    masks.frame = FrameId(static_cast<std::uint32_t>(k));
    masks.ids = GreyImage(camera_.width(), camera_.height());
    for (const Thing& thing : things) paint(thing, k, image, masks);
    if (is_one_instance) join(masks);
    waiting_.push_back(std::make_shared<const Segmentation>(masks));
    ObjectInput input;
    input.frame = masks.frame;
    input.stamp = {static_cast<std::int64_t>(k * 1e9 / kRate_hz)};
    input.thumbnail = make_thumbnail(image);
    input.points = points(k, image.depth_m);
    while (std::ssize(waiting_) > mask_delay) {
      input.masks.push_back(waiting_.front());
      waiting_.pop_front();
    }
    return input;
  }

  [[nodiscard]] PixelBox box_of(const Thing& thing, int k) const {
    const Vec3 c = at(thing, k), half(thing.width_m / 2, thing.height_m / 2, 0);
    const Vec2 low = camera_.project(c - half), high = camera_.project(c + half);
    return {static_cast<float>(low.x()), static_cast<float>(low.y()), static_cast<float>(high.x()),
            static_cast<float>(high.y())};
  }
  [[nodiscard]] const Camera& camera() const { return camera_; }

 private:
  static Vec3 at(const Thing& thing, int k) {
    return thing.centre + k / kRate_hz * thing.velocity_mps;
  }

  static void join(Segmentation& masks) {
    Instance& all = masks.instances.at(0);
    for (const Instance& one : masks.instances) {
      all.x0 = std::min(all.x0, one.x0), all.y0 = std::min(all.y0, one.y0);
      all.x1 = std::max(all.x1, one.x1), all.y1 = std::max(all.y1, one.y1);
    }
    masks.instances.resize(1);
    for (std::uint8_t& id : masks.ids) id = std::min<std::uint8_t>(id, 1);
  }

  void paint(const Thing& thing, int k, RgbdFrame& image, Segmentation& masks) const {
    const PixelBox box = box_of(thing, k);
    const auto depth_m = static_cast<float>(at(thing, k).z());
    const float shown_to = box.x0 + static_cast<float>(shown) * box.width();
    if (thing.in_mask)
      masks.instances.push_back({kPerson, thing.score, box.x0, box.y0, shown_to, box.y1});
    const auto id = static_cast<std::uint8_t>(thing.in_mask ? masks.instances.size() : 0);
    for (int v = 0; v < camera_.height(); ++v) {
      for (int u = 0; u < camera_.width(); ++u) {
        const auto x = static_cast<float>(u), y = static_cast<float>(v);
        if (x < box.x0 || x >= box.x1 || y < box.y0 || y >= box.y1) continue;
        if (image.depth_m.at(u, v) < depth_m) continue;
        image.depth_m.at(u, v) = x < shown_to ? depth_m : 0;
        image.colour.at(u, v) = thing.colour;
        masks.ids.at(u, v) = x < shown_to ? id : 0;
      }
    }
  }

  /// Those that nothing hides.
  std::vector<ObjectPoint> points(int k, const DepthImage& depth_m) {
    std::vector<ObjectPoint> result;
    std::map<std::pair<std::size_t, int>, std::int32_t> index;
    for (std::size_t t = 0; t < things.size(); ++t) {
      const Thing& thing = things[t];
      Rng rng(t + 1);
      for (int i = 0; i < thing.points; ++i) {
        const double up_m = rng.uniform(-0.48, 0.48) * thing.height_m;
        const Vec3 offset(rng.uniform(-0.48, 0.48) * thing.width_m, up_m, 0);
        ObjectPoint p;
        p.p_odom = at(thing, k) + offset;
        p.depth_m = static_cast<float>(p.p_odom.z());
        p.uv_px = camera_.project(p.p_odom).cast<float>();
        const int u = static_cast<int>(p.uv_px.x()), v = static_cast<int>(p.uv_px.y());
        if (!depth_m.contains(u, v) || depth_m.at(u, v) < p.depth_m - 0.01F) continue;
        const auto before = before_.find({t, i});
        if (before != before_.end() && thing.same_points) p.previous = before->second;
        p.moves = thing.velocity_mps.norm() > 0;
        p.stands = !p.moves;
        index[{t, i}] = static_cast<std::int32_t>(result.size());
        result.push_back(p);
      }
    }
    before_ = std::move(index);
    return result;
  }

  Camera camera_ = small_camera();
  std::deque<SegmentationPtr> waiting_;
  std::map<std::pair<std::size_t, int>, std::int32_t> before_;
};

/// Steps over frames [from, to).
inline std::vector<TrackedObject> run(ObjectTracker& tracker, Scene& scene, int from, int to) {
  std::vector<TrackedObject> objects;
  for (int k = from; k < to; ++k) objects = tracker.step(scene.frame(k));
  return objects;
}

inline std::vector<TrackedObject> seen(std::vector<TrackedObject> objects) {
  std::erase_if(objects, [](const TrackedObject& o) { return o.box_px.empty(); });
  return objects;
}

}  // namespace ygslam::testing
