#include "dense/thing_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace ygslam {
namespace {

constexpr int kStepPx = 2;              // between the pixels that are looked at
constexpr double kGrainM = 0.025;       // one point for a cube of this size
constexpr double kSmallShare = 0.7;     // of its pixels that are not near its mask's edge
constexpr std::size_t kMinPoints = 12;  // 75 cm2 of surface

}  // namespace

GreyImage eroded(const GreyImage& ids, int radius_px) {
  if (ids.empty() || radius_px <= 0) return ids;
  // Separable: length of the run of equal values, forwards and backwards.
  const auto keep_inner = [radius_px](auto read, auto clear, int n) {
    for (int i = 1, run = radius_px; i < n; ++i) {
      run = read(i) == read(i - 1) ? run + 1 : 0;
      if (run < radius_px) clear(i);
    }
    for (int i = n - 2, run = radius_px; i >= 0; --i) {
      run = read(i) == read(i + 1) ? run + 1 : 0;
      if (run < radius_px) clear(i);
    }
  };
  GreyImage rows = ids;
  for (int v = 0; v < ids.height(); ++v) {
    keep_inner([&](int u) { return ids.at(u, v); }, [&](int u) { rows.at(u, v) = 0; }, ids.width());
  }
  GreyImage result = rows;
  for (int u = 0; u < ids.width(); ++u) {
    keep_inner([&](int v) { return rows.at(u, v); }, [&](int v) { result.at(u, v) = 0; },
               ids.height());
  }
  return result;
}

GreyImage without_edges(const GreyImage& ids, int radius_px) {
  GreyImage inner = eroded(ids, radius_px);
  std::array<int, 256> before{}, after{};
  for (const std::uint8_t id : ids) ++before[id];
  for (const std::uint8_t id : inner) ++after[id];
  std::transform(ids.begin(), ids.end(), inner.begin(), inner.begin(),
                 [&](std::uint8_t id, std::uint8_t kept) {
                   return after[id] < kSmallShare * before[id] ? id : kept;
                 });
  return inner;
}

std::vector<ThingView> thing_views(DepthView& view, const std::vector<Detection>& detections,
                                   double max_depth_m) {
  std::vector<ThingView> things(detections.size());
  for (std::size_t i = 0; i < things.size(); ++i) things[i].detection = detections[i];
  std::vector<std::set<std::array<int, 3>>> taken(detections.size());
  const auto detection_of = [&](std::uint8_t object) {
    return static_cast<std::size_t>(view.objects[object - 1U]) - 1;
  };
  const Pinhole& camera = view.camera;
  for (int v = 0; v < view.depth.height(); v += kStepPx) {
    for (int u = 0; u < view.depth.width(); u += kStepPx) {
      const std::uint8_t object = view.object.at(u, v);
      const double depth_m = view.depth.at(u, v) * DepthView::kUnit_m;
      if (object == DepthView::kNothing || object == DepthView::kExcluded || depth_m <= 0 ||
          depth_m > max_depth_m)
        continue;
      const Vec3 p((u - camera.cx) / camera.fx * depth_m, (v - camera.cy) / camera.fy * depth_m,
                   depth_m);
      std::array<int, 3> grain{};
      for (int axis = 0; axis < 3; ++axis)
        grain[static_cast<std::size_t>(axis)] = static_cast<int>(std::floor(p[axis] / kGrainM));
      const std::size_t i = detection_of(object);
      if (taken[i].insert(grain).second) things[i].p_camera.push_back(p.cast<float>());
    }
  }
  for (ThingView& thing : things)
    if (thing.p_camera.size() < kMinPoints) thing.p_camera = {};
  for (std::uint8_t& object : view.object) {
    const bool is_thing = object != DepthView::kNothing && object != DepthView::kExcluded;
    if (is_thing && things[detection_of(object)].p_camera.empty()) object = DepthView::kNothing;
  }
  return things;
}

}  // namespace ygslam
