#include "objects/instance_view.hpp"

#include <algorithm>
#include <cmath>

#include "objects/quantile.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMinSamples = 6;  // of a thumbnail: about 400 pixels of the image
constexpr double kSameShare = 0.5;      // of the smaller of two boxes that lies in the other ...
constexpr double kSameDepth_m = 0.3;    // ... at the same depth: bodies cannot be there both
constexpr double kOwnShare = 0.2;   // of its box; fewer pixels are what the better mask left over
constexpr double kBoxShare = 0.05;  // of the points left out on either side of the box in space

/// Whether a less certain instance is a thing already found, or a part of it: a network often finds
/// a head or a torso once more.
bool is_same(const InstanceView& view, const InstanceView& better) {
  const float smaller = std::min(view.box.area(), better.box.area());
  if ((view.box & better.box).area() < kSameShare * smaller) return false;
  if (view.own_share < kOwnShare || !view.has_depth || !better.has_depth) return true;
  return std::abs(view.depth_m - better.depth_m) <= kSameDepth_m;
}

}  // namespace

Thumbnail make_thumbnail(const RgbdFrame& frame) {
  constexpr int kStep = Thumbnail::kStep;
  const int width = (frame.depth_m.width() + kStep - 1) / kStep;
  const int height = (frame.depth_m.height() + kStep - 1) / kStep;
  Thumbnail result{DepthImage(width, height), ColourImage(width, height)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      result.depth_m.at(x, y) = frame.depth_m.at(x * kStep, y * kStep);
      if (frame.colour.same_size(frame.depth_m))
        result.colour.at(x, y) = frame.colour.at(x * kStep, y * kStep);
    }
  }
  return result;
}

void Appearance::add(const Rgb8& colour, bool lower) {
  ++share_[lower ? 1 : 0][(colour.r / 64) * 16 + (colour.g / 64) * 4 + colour.b / 64];
}

void Appearance::normalise() {
  for (auto& half : share_) {
    float sum = 0;
    for (const float n : half) sum += n;
    for (float& n : half) n = sum > 0 ? n / sum : 0;
  }
}

void Appearance::blend(const Appearance& newer, float share) {
  for (std::size_t h = 0; h < share_.size(); ++h)
    for (std::size_t b = 0; b < share_[h].size(); ++b)
      share_[h][b] += share * (newer.share_[h][b] - share_[h][b]);
}

double Appearance::similarity(const Appearance& other) const {
  double sum = 0;
  for (std::size_t h = 0; h < share_.size(); ++h)
    for (std::size_t b = 0; b < share_[h].size(); ++b)
      sum += std::sqrt(share_[h][b] * other.share_[h][b]);
  return sum / static_cast<double>(share_.size());
}

bool measure(std::uint8_t id, const GreyImage& ids, const Thumbnail& thumbnail,
             const Camera& camera, const SE3& T_odom_camera, InstanceView& view) {
  constexpr int kStep = Thumbnail::kStep;
  const PixelBox& box = view.box;
  const float middle_v = (box.y0 + box.y1) / 2;
  std::vector<Vec3> points_odom;
  std::vector<double> depths_m;
  std::size_t samples = 0;
  for (int y = static_cast<int>(box.y0) / kStep;
       y < thumbnail.colour.height() && static_cast<float>(y * kStep) <= box.y1; ++y) {
    for (int x = static_cast<int>(box.x0) / kStep;
         x < thumbnail.colour.width() && static_cast<float>(x * kStep) <= box.x1; ++x) {
      const int u = x * kStep, v = y * kStep;
      if (!ids.contains(u, v) || ids.at(u, v) != id) continue;
      ++samples;
      view.appearance.add(thumbnail.colour.at(x, y), static_cast<float>(v) > middle_v);
      const float depth_m = thumbnail.depth_m.at(x, y);
      if (!(depth_m > 0) || !std::isfinite(depth_m)) continue;
      depths_m.push_back(depth_m);
      points_odom.push_back(T_odom_camera *
                            camera.unproject(camera.undistort(Vec2(u, v)), depth_m));
    }
  }
  view.appearance.normalise();
  view.has_depth = depths_m.size() >= kMinSamples;
  if (view.has_depth) {
    view.depth_m = static_cast<float>(quantile(depths_m, 0.5));
    view.centre_odom = axis_quantile(points_odom, 0.5);
    view.min_odom = axis_quantile(points_odom, kBoxShare);
    view.max_odom = axis_quantile(points_odom, 1 - kBoxShare);
  }
  view.own_share = static_cast<double>(samples * kStep * kStep) / box.area();
  return samples >= kMinSamples;
}

std::vector<InstanceView> view_instances(const Segmentation& masks, const Thumbnail& thumbnail,
                                         const Camera& camera, const SE3& T_odom_camera,
                                         const MovableClasses& movable) {
  const PixelBox image{0, 0, static_cast<float>(masks.ids.width()),
                       static_cast<float>(masks.ids.height())};
  std::vector<InstanceView> views;
  for (std::size_t i = 0; i < masks.instances.size(); ++i) {
    const Instance& instance = masks.instances[i];
    const PixelBox box = PixelBox{instance.x0, instance.y0, instance.x1, instance.y1} & image;
    if (!movable.contains(instance.class_id) || box.empty() || !(instance.score > 0)) continue;
    InstanceView view;
    view.class_id = instance.class_id;
    view.score = instance.score;
    view.ids = {static_cast<std::uint8_t>(i + 1)};
    view.box = box;
    if (measure(view.ids.front(), masks.ids, thumbnail, camera, T_odom_camera, view))
      views.push_back(std::move(view));
  }
  std::stable_sort(views.begin(), views.end(),
                   [](const InstanceView& a, const InstanceView& b) { return a.score > b.score; });
  std::vector<InstanceView> things;
  for (InstanceView& view : views) {
    std::vector<InstanceView*> same;
    for (InstanceView& thing : things)
      if (thing.class_id == view.class_id && is_same(view, thing)) same.push_back(&thing);
    if (same.empty()) {
      things.push_back(std::move(view));
    } else if (same.size() == 1) {  // one box about several things is nothing of its own
      same.front()->box = same.front()->box | view.box;
      same.front()->ids.push_back(view.ids.front());
    }
  }
  return things;
}

}  // namespace ygslam
