#include "motion/flow/flow_follower.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/statistics.hpp"
#include "motion/flow/harris.hpp"

namespace ygslam {
namespace {

constexpr int kHarrisCorners = 1000;
constexpr double kHarrisDistance_px = 8;
constexpr int kDepthEdge_px = 3;       // how far depth edges lie from the colour image's
constexpr double kUsualDepth_m = 2.0;  // where a frame has no depth at all
constexpr double kLeastDepth_m = 0.05;
constexpr double kFar_m = 1e6;  // where only rotation shows
constexpr double kStartGrid_px = 1.0 / 32;

float median_depth_m(const Features& features) {
  std::vector<float> depths;
  for (const Feature& f : features.points)
    if (f.depth_m > 0) depths.push_back(f.depth_m);
  if (depths.empty()) return kUsualDepth_m;
  return median(depths);
}

/// Where fixed points should appear; those without depth are taken at the median one.
std::vector<Eigen::Vector2f> predict_ends(const Camera& camera, const Features& features,
                                          const FlowPrediction& predicted) {
  const RollingShutter shutter(camera.height(), predicted.read_out);
  const float usual_m = median_depth_m(features);
  std::vector<Eigen::Vector2f> ends(features.size());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const Feature& f = features.points[i];
    const double depth_m = f.depth_m > 0 ? f.depth_m : usual_m;
    const Vec3 p_cam =
        predicted.T_current_previous * camera.unproject(f.ideal_px.cast<double>(), depth_m);
    ends[i] = f.uv_px;
    if (p_cam.z() <= kLeastDepth_m) continue;
    // On a grid the last bits of a pose do not show: equal motions start equal searches.
    const Vec2 end_px = shutter.seen_at(camera, p_cam);
    ends[i] = ((end_px / kStartGrid_px).array().round() * kStartGrid_px).cast<float>();
  }
  return ends;
}

std::vector<Eigen::Vector2f> positions(const Features& features) {
  std::vector<Eigen::Vector2f> points(features.size());
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = features.points[i].uv_px;
  return points;
}

/// Ends and pairs of points that start at from_ideal_px; depths and labels still empty.
Followed from_flow(const Camera& camera, std::span<const Vec2> from_ideal_px,
                   std::span<const FlowPoint> flow) {
  const Vec2 invalid = Vec2::Constant(std::numeric_limits<double>::quiet_NaN());
  Followed followed;
  followed.ends = flow_ends(flow);
  followed.pairs.resize(flow.size());
  followed.points.resize(flow.size());
  followed.label.resize(flow.size(), MotionLabel::kUnknown);
  for (std::size_t i = 0; i < flow.size(); ++i) {
    const Vec2 end =
        followed.ends[i].found ? camera.undistort(flow[i].end_uv_px.cast<double>()) : invalid;
    followed.pairs[i] = {from_ideal_px[i], end};
    followed.points[i] = {from_ideal_px[i], end, 0, {}};
  }
  return followed;
}

}  // namespace

std::vector<DepthRange> depth_ranges(const Features& features, const DepthImage& depth_m) {
  std::vector<DepthRange> ranges(features.size());
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const Eigen::Vector2f& px = features.points[i].uv_px;
    if (!px.allFinite() || px.cwiseAbs().maxCoeff() > 1e6F) continue;
    ranges[i] = depth_range(depth_m, static_cast<int>(std::lround(px.x())),
                            static_cast<int>(std::lround(px.y())), kDepthEdge_px);
  }
  return ranges;
}

Followed follow_features(const Camera& camera, const FlowFrame& previous,
                         const ImagePyramid& current,
                         const std::optional<FlowPrediction>& predicted, const FlowConfig& config) {
  const Features& features = *previous.features;
  std::vector<Eigen::Vector2f> guesses;
  if (predicted) guesses = predict_ends(camera, features, *predicted);
  const auto flow = track_points(previous.pyramid, current, positions(features), guesses, config);
  std::vector<Vec2> from(features.size());
  for (std::size_t i = 0; i < from.size(); ++i)
    from[i] = features.points[i].ideal_px.cast<double>();
  Followed followed = from_flow(camera, from, flow);
  followed.label = previous.label;
  for (std::size_t i = 0; i < followed.size(); ++i) {
    followed.points[i].depth_m = features.points[i].depth_m;
    followed.points[i].range = previous.range[i];
  }
  return predicted ? with_motion(camera, std::move(followed), *predicted) : followed;
}

Followed with_motion(const Camera& camera, Followed followed, const FlowPrediction& motion) {
  const RollingShutter shutter(camera.height(), motion.read_out);
  if (!shutter.is_rolling()) return followed;
  for (std::size_t i = 0; i < followed.size(); ++i) {
    if (!followed.ends[i].found) continue;
    FollowedPoint& point = followed.points[i];
    const Vec2 end_uv_px = followed.ends[i].uv_px.cast<double>();
    const double depth_m =
        point.depth_m > 0
            ? (motion.T_current_previous * camera.unproject(point.previous_px, point.depth_m)).z()
            : kFar_m;
    const Vec3 p_middle = shutter.to_middle(
        camera.unproject(camera.undistort(end_uv_px), std::max(depth_m, kLeastDepth_m)),
        end_uv_px.y());
    if (p_middle.z() <= kLeastDepth_m) continue;
    point.current_px = followed.pairs[i].p2_px = camera.project(p_middle);
  }
  return followed;
}

Followed follow_harris(const Camera& camera, const FlowFrame& previous, const ImagePyramid& current,
                       double link_radius_px, const FlowConfig& config) {
  const auto corners = harris_corners(previous.pyramid, kHarrisCorners, kHarrisDistance_px);
  const auto flow = track_points(previous.pyramid, current, corners, {}, config);
  std::vector<Vec2> from(corners.size());
  for (std::size_t i = 0; i < from.size(); ++i)
    from[i] = camera.undistort(corners[i].cast<double>());
  Followed followed = from_flow(camera, from, flow);

  std::vector<FlowEnd> at(previous.features->size());
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = {previous.features->points[i].uv_px, true};
  std::vector<Feature> queries(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) queries[i].uv_px = corners[i];
  const auto nearest = link_to_previous(queries, at, link_radius_px);
  for (std::size_t i = 0; i < followed.size(); ++i) {
    const std::int32_t k = nearest[i];
    if (k < 0) continue;
    followed.label[i] = previous.label[k];
    followed.points[i].depth_m = previous.features->points[k].depth_m;
    followed.points[i].range = previous.range[k];
  }
  return followed;
}

}  // namespace ygslam
