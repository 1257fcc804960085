#include "live/run_messages.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/rng.hpp"

namespace ygslam {
namespace {

SE3 pose_of(const ros::Pose& pose) {
  const auto& [p, q] = pose;
  return SE3(Eigen::Quaterniond(q.w, q.x, q.y, q.z).toRotationMatrix(), Vec3(p.x, p.y, p.z));
}

/// Nearly normal: the sum of twelve.
double normal(Rng& rng) {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += rng.below(1U << 30U) / static_cast<double>(1U << 30U);
  return sum;
}

TEST(RunMessages, CovarianceIsThatOfThePoseInTheAxesOfOdom) {
  Rng rng(5);
  Mat6 root;
  for (double& entry : root.reshaped()) entry = 1e-3 * normal(rng);
  TrackResult result;
  result.state = TrackState::kTracking;
  result.T_odom_camera = SE3::exp((Vec6() << 0.4, -0.2, 1.1, 0.6, -1.1, 0.3).finished());
  result.covariance = root * root.transpose();
  const RgbdFrame frame;
  const ros::Odometry told = odometry_message(frame, result);
  const SE3 T_odom_camera = pose_of(told.pose);

  Mat6 seen = Mat6::Zero();
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    Vec6 unit;
    for (double& entry : unit) entry = normal(rng);
    TrackResult other = result;
    other.T_odom_camera = (SE3::exp(root * unit) * result.T_odom_camera.inverse()).inverse();
    const SE3 T = pose_of(odometry_message(frame, other).pose);
    const Eigen::AngleAxisd turn(T.R() * T_odom_camera.R().transpose());  // about odom's axes
    Vec6 error;
    error << T.t() - T_odom_camera.t(), turn.angle() * turn.axis();
    seen += error * error.transpose() / kSamples;
  }
  const Eigen::Map<const Mat6> covariance(told.pose_covariance.data());  // symmetric
  EXPECT_LT((covariance - seen).norm(), 0.03 * seen.norm());
  EXPECT_EQ(told.twist_covariance[0], kUnknownVariance);
  EXPECT_EQ(told.header.frame_id, "odom");
}

TEST(RunMessages, WhatIsNotKnownSaysSo) {
  TrackResult lost;
  lost.state = TrackState::kLost;
  EXPECT_EQ(odometry_message({}, lost).pose_covariance[35], kUnknownVariance);
  EXPECT_EQ(tf_message({}, lost).transforms.front().header.frame_id, "odom") << "no map -> odom";
  TrackResult first;
  first.state = TrackState::kTracking;
  EXPECT_EQ(odometry_message({}, first).pose_covariance[0], 0) << "the origin itself";
}

TEST(RunMessages, AxesAreThoseOfRep103) {
  TrackResult result;
  result.state = TrackState::kTracking;
  result.T_odom_camera = SE3(Mat3::Identity(), Vec3(1, 2, 3));  // right, down, forward
  const ros::TfMessage tf = tf_message({}, result);
  ASSERT_EQ(tf.transforms.size(), 3U);
  const ros::Pose& camera = tf.transforms[1].transform;
  EXPECT_DOUBLE_EQ(camera.position.x, 3);
  EXPECT_DOUBLE_EQ(camera.position.y, -1);
  EXPECT_DOUBLE_EQ(camera.position.z, -2);
  // A point ahead in the image's axes lies on x of the camera's body.
  const Vec3 ahead = pose_of(tf.transforms[2].transform) * Vec3(0, 0, 1);
  EXPECT_NEAR((ahead - Vec3(1, 0, 0)).norm(), 0, 1e-12);
}

TEST(RunMessages, TheFloorIsLevelInMap) {
  Gravity gravity;
  gravity.up_world = Vec3(0, -0.8, -0.6);  // a camera that looks down
  gravity.floor_m = -1.5;
  const ros::TfMessage told = floor_message(gravity, {});
  ASSERT_EQ(told.transforms.size(), 1U);
  EXPECT_EQ(told.transforms[0].header.frame_id, "map");
  EXPECT_EQ(told.transforms[0].child_frame_id, "floor");
  const SE3 T_map_floor = pose_of(told.transforms[0].transform);
  const Vec3 up_map = T_body_optical() * gravity.up_world;
  EXPECT_NEAR((T_map_floor.R().col(2) - up_map).norm(), 0, 1e-9);
  EXPECT_NEAR(T_map_floor.t().dot(up_map), -1.5, 1e-9);
}

TEST(RunMessages, PointsHaveTheColourOfTheirLabel) {
  TrackResult result;
  auto features = std::make_shared<Features>();
  features->points.resize(4);
  for (std::size_t i = 0; i < 4; ++i)
    features->points[i].uv_px = {10.0 * static_cast<double>(i), 5};
  result.features = features;
  result.labels.label = {MotionLabel::kDynamic, MotionLabel::kStatic, MotionLabel::kUnknown,
                         MotionLabel::kStatic};
  std::vector<std::pair<double, double>> seen;  // how green each is, and its column
  for (const ros::PointsAnnotation& points : annotation_message({}, result).points)
    for (const ros::Point2& p : points.points) seen.emplace_back(points.outline_colour.g, p.x);
  EXPECT_EQ(seen, (std::vector<std::pair<double, double>>{{.8, 10}, {.8, 30}, {.2, 0}, {.85, 20}}));
}

TEST(RunMessages, TheNewestMaskIsOutlined) {
  const auto mask = [](std::int64_t stamp_ns, int x0, int x1) {
    Segmentation made;
    made.stamp.ns = stamp_ns;
    made.ids = GreyImage(64, 48, 0);
    for (int y = 8; y < 48; ++y)
      for (int x = x0; x < x1; ++x) made.ids.at(x, y) = 1;
    return std::make_shared<const Segmentation>(std::move(made));
  };
  TrackResult result;
  result.masks = {mask(2'000'000'001, 16, 40), mask(1, 0, 64)};
  const ros::ImageAnnotations told = annotation_message({}, result);
  ASSERT_EQ(told.points.size(), 4U);
  const ros::PointsAnnotation& outline = told.points[3];
  EXPECT_EQ(outline.type, ros::PointsAnnotation::kLineList);
  EXPECT_EQ(outline.timestamp.sec, 2);
  std::vector<std::array<double, 4>> lines;
  for (std::size_t i = 0; i + 1 < outline.points.size(); i += 2)
    lines.push_back({outline.points[i].x, outline.points[i].y, outline.points[i + 1].x,
                     outline.points[i + 1].y});
  std::ranges::sort(lines);
  EXPECT_EQ(lines, (std::vector<std::array<double, 4>>{
                       {16, 8, 16, 48}, {16, 8, 40, 8}, {16, 48, 40, 48}, {40, 8, 40, 48}}));
  result.masks.clear();
  EXPECT_EQ(annotation_message({}, result).points.size(), 3U) << "none came";
}

TEST(RunMessages, WhoHasFadedIsGreyAndFainter) {
  TrackResult result;
  result.objects.resize(2);
  result.objects[1].faded = true;
  const auto markers = object_message({}, result).markers;
  ASSERT_EQ(markers.size(), 7U) << "a clearing, then box, name and velocity of each";
  const ros::Colour &live = markers[1].colour, &faded = markers[4].colour;
  EXPECT_GT(live.r, live.g) << "red";
  EXPECT_EQ(faded.r, faded.g);
  EXPECT_LT(faded.a, live.a);
  EXPECT_LT(markers[5].colour.a, markers[2].colour.a);
  for (const ros::Marker& marker : markers) EXPECT_EQ(marker.header.frame_id, "map");
}

TEST(RunMessages, LoopsThatWereTakenBackAreNoLoops) {
  Map map(PyramidScales(8, 1.2));
  for (std::uint32_t id = 0; id < 3; ++id) {
    auto data = std::make_shared<KeyframeData>();
    data->id = KeyframeId{id};
    data->features = std::make_shared<Features>();
    const SE3 T_camera_world(Mat3::Identity(), Vec3(0, 0, -1.0 * id));
    map.add_keyframe(data, T_camera_world, id == 0 ? kNoKeyframe : KeyframeId{id - 1}, {});
  }
  const auto attempt = [](std::uint32_t keyframe, std::uint32_t place, LoopOutcome outcome) {
    LoopAttempt made;
    made.keyframe = KeyframeId{keyframe};
    made.match.place = KeyframeId{place};
    made.outcome = outcome;
    return made;
  };
  const std::vector<LoopAttempt> attempts = {
      attempt(1, 0, LoopOutcome::kTooFar), attempt(2, 1, LoopOutcome::kAlone),
      attempt(2, 0, LoopOutcome::kClosed), attempt(9, 0, LoopOutcome::kClosed)};
  const ros::MarkerArray told = loop_message(map, attempts, {});
  ASSERT_EQ(told.markers.size(), 1U);
  const auto& points = told.markers[0].points;
  ASSERT_EQ(points.size(), 2U) << "2 to 0; 9 is no more in the map";
  EXPECT_DOUBLE_EQ(points[0].x, 2);
  EXPECT_DOUBLE_EQ(points[1].x, 0);
}

}  // namespace
}  // namespace ygslam
