// The map may be corrected in the middle of a run: what a loop closure will do, done by chance.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/rng.hpp"
#include "core/statistics.hpp"
#include "core/testing/recorded_data.hpp"
#include "io/frame_reader.hpp"
#include "io/trajectory_formats.hpp"
#include "io/tum_sequence.hpp"
#include "segment/recorded_masks.hpp"
#include "system/testing/rendered_recording.hpp"

namespace ygslam {
namespace {

using namespace system_test;

SE3 motion(Rng& rng, double angle_rad, double distance_m) {
  Vec6 twist;
  for (int i = 0; i < 3; ++i) twist[i] = rng.uniform(-distance_m, distance_m);
  for (int i = 3; i < 6; ++i) twist[i] = rng.uniform(-angle_rad, angle_rad);
  return SE3::exp(twist);
}

/// Moves the whole world as one piece.
MapPatch moved(const Map& map, Rng& rng) {
  MapPatch patch = map.start_patch();
  const SE3 T_old_new = motion(rng, 1.0, 2.0);
  for (const auto& [id, keyframe] : map.keyframes())
    patch.poses.push_back({id, keyframe.T_camera_world, keyframe.T_camera_world * T_old_new});
  return patch;
}

/// Bends it as a pose graph would: each keyframe a little differently from the one before.
MapPatch bent(const Map& map, Rng& rng) {
  MapPatch patch = map.start_patch();
  SE3 T_old_new;
  for (const auto& [id, keyframe] : map.keyframes()) {
    patch.poses.push_back({id, keyframe.T_camera_world, keyframe.T_camera_world * T_old_new});
    T_old_new = T_old_new * motion(rng, 0.0001, 0.0005);
  }
  return patch;
}

using Correction = MapPatch (*)(const Map&, Rng&);

struct CorrectedTrial : Trial {
  using Trial::Trial;
  std::vector<std::size_t> corrected;  ///< frames before which the map was
};

CorrectedTrial run_corrected(std::unique_ptr<Runner> runner, const Recording& recording,
                             Correction correction, std::uint64_t seed) {
  CorrectedTrial run(std::move(runner));
  Rng rng(seed);
  for (std::size_t i = 0; i < recording.frames.size(); ++i) {
    if (i > 5 && rng.below(16) == 0) {
      run.runner->correct(correction(run.map(), rng));
      run.corrected.push_back(i);
    }
    run.process(recording.frames[i]);
  }
  run.finish();
  return run;
}

/// Of the motions from frame to frame in the odometry frame; nothing for the first.
std::vector<double> odometry_differences_m(const Trial& a, const Trial& b) {
  std::vector<double> result = {0};
  for (std::size_t i = 1; i < a.results.size(); ++i) {
    const auto step = [&](const Trial& run) {
      return run.results[i - 1].T_odom_camera.inverse() * run.results[i].T_odom_camera;
    };
    result.push_back((step(a).t() - step(b).t()).norm());
  }
  return result;
}

std::vector<std::uint32_t> object_ids(const TrackResult& result) {
  std::vector<std::uint32_t> ids;
  for (const TrackedObject& object : result.objects) ids.push_back(index(object.id));
  return ids;
}

struct Scene {
  Recording recording;
  SlamConfig config;
  std::function<std::unique_ptr<Segmenter>()> make_segmenter;
  double odometry_noise_m = 0;  ///< from one choice of matches to another, per frame
};

Scene rendered() {
  const auto recording = std::make_shared<const Recording>(record("walking_xyz", small(6.0)));
  return {*recording, small_config(DynamicMode::kFull),
          [recording] { return std::make_unique<TruthSegmenter>(*recording); }, 0.005};
}

std::filesystem::path recording_folder() {
  return ygslam::testing::shared_folder() / "data/redkitchen_walk";
}

/// Two recorded people in a recorded room.
Scene recorded() {
  const auto root = recording_folder();
  auto sequence = open_tum_sequence(root);
  CHECK(sequence.ok());
  const SlamConfig config = resolved(SlamConfig()).value();
  Recording recording{Camera(sequence->camera), {}, {}, {}};
  FrameReader reader(*sequence, FrameReaderConfig{});
  while (auto frame = reader.next()) recording.frames.push_back(*frame);
  CHECK(recording.frames.size() == sequence->pairs.size());
  const auto truth = read_tum_trajectory(root / "groundtruth.txt");
  CHECK(truth.ok());
  recording.truth = *truth;
  return Scene{std::move(recording), config,
               [root] { return make_recorded_segmenter(root / "mask").value(); }, 0.01};
}

void expect_undisturbed_by_rigid_motions(const Scene& scene) {
  const Trial still = run_offline(scene.config, scene.recording, scene.make_segmenter());
  const CorrectedTrial moving = run_corrected(
      make_offline_runner(scene.config, scene.recording.camera, scene.make_segmenter()),
      scene.recording, moved, 3);
  ASSERT_GE(moving.corrected.size(), 5U);
  for (std::size_t i = 0; i < still.results.size(); ++i) {
    const TrackResult& a = still.results[i];
    const TrackResult& b = moving.results[i];
    ASSERT_EQ(a.state, b.state) << i;
    EXPECT_EQ(a.labels.label, b.labels.label) << i;
    EXPECT_EQ(a.candidate.has_value(), b.candidate.has_value()) << i;
    EXPECT_EQ(object_ids(a), object_ids(b)) << i;
    EXPECT_LT((b.T_world_odom * b.T_odom_camera * b.T_world_camera.inverse()).log().norm(), 1e-9);
  }
  for (const double difference_m : odometry_differences_m(still, moving))
    EXPECT_LT(difference_m, 1e-5);
  const double ate_m = ate_rmse_m(scene.recording, still.trajectory());
  EXPECT_NEAR(ate_rmse_m(scene.recording, moving.trajectory()), ate_m, 0.01 * ate_m);
}

void expect_to_go_on_in_a_bent_world(const Scene& scene) {
  const Trial still = run_offline(scene.config, scene.recording, scene.make_segmenter());
  const CorrectedTrial bending = run_corrected(
      make_offline_runner(scene.config, scene.recording.camera, scene.make_segmenter()),
      scene.recording, bent, 4);
  std::size_t points = 0;
  std::size_t equal = 0;
  for (std::size_t i = 0; i < still.results.size(); ++i) {
    EXPECT_EQ(still.results[i].state, bending.results[i].state) << i;
    const auto& a = still.results[i].labels.label;
    const auto& b = bending.results[i].labels.label;
    points += a.size();
    for (std::size_t k = 0; k < a.size(); ++k) equal += a[k] == b[k] ? 1 : 0;
  }
  EXPECT_GT(static_cast<double>(equal), 0.97 * static_cast<double>(points));
  // Where the world was bent the odometry steps as in the undisturbed run: the two choose other
  // matches, but no more so than in the frames between.
  std::vector<double> bent_m, between_m;
  const auto differences_m = odometry_differences_m(still, bending);
  for (std::size_t i = bending.corrected.front(); i < differences_m.size(); ++i)
    (std::ranges::count(bending.corrected, i) > 0 ? bent_m : between_m).push_back(differences_m[i]);
  EXPECT_LT(median(bent_m), 2 * median(between_m) + 0.0002);
  EXPECT_LT(std::ranges::max(bent_m),
            std::max(scene.odometry_noise_m, std::ranges::max(between_m)));
  EXPECT_LT(ate_rmse_m(scene.recording, bending.trajectory()),
            ate_rmse_m(scene.recording, still.trajectory()) + 0.02);
}

TEST(MovingWorld, RigidMotionsChangeNothingRendered) {
  expect_undisturbed_by_rigid_motions(rendered());
}

TEST(MovingWorld, ABentWorldIsFollowedRendered) { expect_to_go_on_in_a_bent_world(rendered()); }

TEST(MovingWorld, RigidMotionsChangeNothingRecorded) {
  YGSLAM_NEEDS_RECORDED(recording_folder());
  expect_undisturbed_by_rigid_motions(recorded());
}

TEST(MovingWorld, ABentWorldIsFollowedRecorded) {
  YGSLAM_NEEDS_RECORDED(recording_folder());
  expect_to_go_on_in_a_bent_world(recorded());
}

TEST(MovingWorld, CorrectionsInTheMiddleOfALiveRunAreFollowed) {
  const Scene scene = rendered();
  const CorrectedTrial run =
      run_corrected(make_live_runner(scene.config, scene.recording.camera, scene.make_segmenter()),
                    scene.recording, moved, 7);
  EXPECT_EQ(lost_frames(run), 0);
  EXPECT_LT(ate_rmse_m(scene.recording, run.trajectory()), 0.02);
  for (std::size_t i = 1; i < run.results.size(); ++i) {
    const SE3 step = run.results[i - 1].T_odom_camera.inverse() * run.results[i].T_odom_camera;
    EXPECT_LT(step.t().norm(), 0.1) << "the odometry jumped at frame " << i;
  }
}

}  // namespace
}  // namespace ygslam
