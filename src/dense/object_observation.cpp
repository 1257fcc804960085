#include "dense/object_observation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>

#include "core/check.hpp"
#include "image/cv_view.hpp"

namespace ygslam {
namespace {

constexpr int kObservationStep_px = 2;         // between the pixels that are looked at
constexpr double kObservationPatch_m = 0.025;  // one point for a cube of this size
constexpr double kSmallShare = 0.5;            // of its pixels that are not near its mask's edge
constexpr std::size_t kMinPoints = 8;          // 50 cm2 of surface
constexpr double kMovingShare = 0.4;           // a mover beside it is no motion of its own

}  // namespace

GreyImage dilated(const GreyImage& mask, int radius_px) {
  if (mask.empty() || radius_px <= 0) return mask;
  GreyImage result(mask.width(), mask.height());
  const int side_px = 2 * radius_px + 1;
  cv::Mat written = cv_view(result);
  cv::dilate(cv_view(mask), written, cv::getStructuringElement(cv::MORPH_RECT, {side_px, side_px}));
  CHECK(written.data == result.data());
  return result;
}

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

std::vector<bool> moving_detections(const GreyImage& things, const GreyImage& movers,
                                    std::size_t detections, std::span<const MotionVotes> votes) {
  CHECK(votes.empty() || votes.size() == detections);
  std::vector<bool> moving(detections, false);
  if (movers.empty() || things.empty()) return moving;
  std::vector<int> pixels(detections + 1, 0), marked(detections + 1, 0);
  for (std::size_t i = 0; i < things.size(); ++i) {
    ++pixels[things.begin()[i]];
    marked[things.begin()[i]] += movers.begin()[i] != 0 ? 1 : 0;
  }
  for (std::size_t i = 0; i < detections; ++i) {
    const MotionVotes vote = votes.empty() ? MotionVotes{} : votes[i];
    const bool may_move = vote == MotionVotes{} || vote.moving > vote.standing;
    moving[i] = may_move && marked[i + 1] > kMovingShare * pixels[i + 1];
  }
  return moving;
}

void exclude_objects(DepthView& view, const std::vector<bool>& is_removed, int radius_px) {
  if (std::find(is_removed.begin(), is_removed.end(), true) == is_removed.end()) return;
  GreyImage gone(view.object.width(), view.object.height());
  std::transform(view.object.begin(), view.object.end(), gone.begin(), [&](std::uint8_t object) {
    return static_cast<std::uint8_t>(DepthView::is_object(object) && is_removed[object - 1U] ? 255
                                                                                             : 0);
  });
  gone = dilated(gone, radius_px);
  std::transform(gone.begin(), gone.end(), view.object.begin(), view.object.begin(),
                 [&](std::uint8_t near, std::uint8_t object) {
                   const bool is_other = DepthView::is_object(object) && !is_removed[object - 1U];
                   return near != 0 && !is_other ? DepthView::kExcluded : object;
                 });
}

std::vector<ObjectObservation> observe_objects(DepthView& view,
                                               const std::vector<Detection>& detections,
                                               double max_depth_m) {
  std::vector<ObjectObservation> things(detections.size());
  for (std::size_t i = 0; i < things.size(); ++i) things[i].detection = detections[i];
  std::vector<std::set<std::array<int, 3>>> taken(detections.size());
  const auto detection_of = [&](std::uint8_t object) {
    return static_cast<std::size_t>(view.objects[object - 1U]) - 1;
  };
  const Pinhole& camera = view.camera;
  for (int v = 0; v < view.depth.height(); v += kObservationStep_px) {
    for (int u = 0; u < view.depth.width(); u += kObservationStep_px) {
      const std::uint8_t object = view.object.at(u, v);
      const double depth_m = view.depth.at(u, v) * DepthView::kUnit_m;
      if (!DepthView::is_object(object) || depth_m <= 0 || depth_m > max_depth_m) continue;
      const Vec3 p((u - camera.cx) / camera.fx * depth_m, (v - camera.cy) / camera.fy * depth_m,
                   depth_m);
      std::array<int, 3> patch{};
      for (int axis = 0; axis < 3; ++axis)
        patch[static_cast<std::size_t>(axis)] =
            static_cast<int>(std::floor(p[axis] / kObservationPatch_m));
      const std::size_t i = detection_of(object);
      const Rgb8 colour = view.colour.at(u, v);
      ++things[i].colours[static_cast<std::size_t>(colour.r / 64 + colour.g / 64 * 4 +
                                                   colour.b / 64 * 16)];
      if (taken[i].insert(patch).second) things[i].p_camera.push_back(p.cast<float>());
    }
  }
  for (ObjectObservation& thing : things)
    if (thing.p_camera.size() < kMinPoints) thing = {thing.detection, {}, {}, false};
  for (std::uint8_t& object : view.object) {
    if (DepthView::is_object(object) && things[detection_of(object)].p_camera.empty())
      object = DepthView::kUnsure;
  }
  return things;
}

}  // namespace ygslam
