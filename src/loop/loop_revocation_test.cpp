// A loop that is taken back leaves the map as it was, whatever came in between.
#include <gtest/gtest.h>

#include <set>

#include "loop/loop_closer.hpp"
#include "loop/loop_test_world.hpp"

namespace ygslam {
namespace {

using loop_test::RingWorld;
using loop_test::Walk;

KeyframeId newest_of(const Map& map) { return map.keyframes().rbegin()->first; }

PlaceIndex made_index(const Map& map) {
  PlaceIndex index;
  index.rebuild(map);
  return index;
}

/// As the mapper would: what both sides see of one point becomes one, what one has not is added.
FusionLog weld(Map& map, const RingWorld& ring, const LoopClosure& closure) {
  FusionLog log;
  std::map<int, LandmarkId> at_place;
  for (const KeyframeId id : closure.place) {
    const auto& landmarks = map.keyframe(id).landmarks;
    for (std::uint32_t k = 0; k < landmarks.size(); ++k)
      if (landmarks[k] != kNoLandmark) at_place[ring.point_of(id, k)] = landmarks[k];
  }
  for (const KeyframeId id : closure.window) {
    const std::vector<LandmarkId> landmarks = map.keyframe(id).landmarks;
    for (std::uint32_t k = 0; k < landmarks.size(); ++k) {
      const auto it = at_place.find(ring.point_of(id, k));
      if (it == at_place.end()) continue;
      const LandmarkId mine = map.keyframe(id).landmarks[k];
      const LandmarkId theirs = map.current_id(it->second);
      if (mine == theirs || theirs == kNoLandmark) continue;
      if (mine == kNoLandmark) {
        if (map.add_observation(theirs, id, k)) log.added.push_back({theirs, id});
        continue;
      }
      const bool keep_mine = k % 2 == 0;
      const LandmarkId from = keep_mine ? theirs : mine;
      const LandmarkId into = keep_mine ? mine : theirs;
      log.before_fusion(map, from, into);
      map.fuse(from, into);
    }
  }
  return log;
}

/// What an adjustment would do: everything a little.
MapPatch shaken(const Map& map, Rng& rng) {
  MapPatch patch = map.start_patch();
  for (const auto& [id, keyframe] : map.keyframes()) {
    Vec6 twist;
    for (double& x : twist) x = rng.uniform(-0.003, 0.003);
    const SE3& T = keyframe.T_camera_world;
    patch.poses.push_back({id, T, id == map.origin() ? T : SE3::exp(twist) * T});
  }
  return patch;
}

double largest_error_px(const Map& map, const Camera& camera) {
  double largest = 0;
  map.for_each_landmark([&](const Landmark& l) {
    for (const LandmarkObservation& o : l.observations) {
      const Keyframe& keyframe = map.keyframe(o.keyframe);
      const Vec3 p_camera = keyframe.T_camera_world * l.p_world;
      const Vec2 px = keyframe.data->features->points[o.feature].ideal_px.cast<double>();
      largest =
          std::max(largest, p_camera.z() < 0.1 ? 1e3 : (camera.project(p_camera) - px).norm());
    }
  });
  return largest;
}

int count_observations(const Map& map, KeyframeId id) {
  const auto& landmarks = map.keyframe(id).landmarks;
  return static_cast<int>(landmarks.size() -
                          static_cast<std::size_t>(std::ranges::count(landmarks, kNoLandmark)));
}

/// All that `before` has, and nothing else of its keyframes.
void expect_as_before(const Map& map, const Map& before, double within) {
  for (const auto& [id, was] : before.keyframes()) {
    const Keyframe& is = map.keyframe(id);
    EXPECT_LT((is.T_camera_world * was.T_camera_world.inverse()).log().norm(), within);
    EXPECT_EQ(is.landmarks, was.landmarks) << index(id);
    for (const auto& [other, shared] : was.covisible)
      EXPECT_EQ(is.covisible.at(other), shared) << index(id) << ' ' << index(other);
    for (const auto& [other, shared] : is.covisible)
      EXPECT_TRUE(!before.has_keyframe(other) || was.covisible.contains(other));
  }
  before.for_each_landmark([&](const Landmark& was) {
    ASSERT_TRUE(map.has_landmark(was.id));
    const Landmark& is = map.landmark(was.id);
    EXPECT_LT((is.p_world - was.p_world).norm(), within);
    EXPECT_EQ(is.first_keyframe, was.first_keyframe);
    EXPECT_EQ(is.visible, was.visible);
    EXPECT_EQ(is.found, was.found);
    std::size_t common = 0;
    for (const LandmarkObservation& o : is.observations)
      common += before.has_keyframe(o.keyframe) ? 1 : 0;
    EXPECT_EQ(common, was.observations.size());
    if (is.observations.size() == was.observations.size()) {
      EXPECT_EQ(is.descriptor, was.descriptor);
      EXPECT_LT((is.normal_world - was.normal_world).norm(), within);
    }
  });
}

class Revocation : public testing::TestWithParam<std::uint64_t> {
 protected:
  RingWorld ring_{GetParam()};
  Walk walk_{.drift_m = 0.25, .drift_rad = 0.02};
  Map map_ = ring_.walk(walk_);
  const Map before_ = map_;
  LoopEffect effect_;

  void close() {
    LoopCloser closer({}, ring_.camera());
    const LoopResult result = closer.step(map_, made_index(map_), newest_of(map_));
    ASSERT_TRUE(result.closure);
    map_.apply(result.closure->patch);
    effect_ = {inverse_poses(result.closure->patch), weld(map_, ring_, *result.closure)};
    ASSERT_GT(effect_.fusions.fusions.size(), 50U);
    ASSERT_LT(map_.landmark_count(), before_.landmark_count());
  }
};

TEST_P(Revocation, LeavesTheMapAsItWas) {
  close();
  map_.apply(make_revocation(map_, ring_.camera(), effect_));
  EXPECT_EQ(map_.landmark_count(), before_.landmark_count());
  expect_as_before(map_, before_, 1e-9);
}

TEST_P(Revocation, TakesTheAdjustmentBackThatFollowed) {
  close();
  Rng rng(GetParam());
  const MapPatch adjustment = shaken(map_, rng);
  map_.apply(adjustment);
  add_adjustment(effect_, adjustment);
  map_.apply(make_revocation(map_, ring_.camera(), effect_));
  EXPECT_EQ(map_.landmark_count(), before_.landmark_count());
  expect_as_before(map_, before_, 1e-9);
}

TEST_P(Revocation, KeyframesMadeSinceGoWithTheirParentsAndSeeWhatTheySaw) {
  close();
  std::map<KeyframeId, int> saw;
  while (map_.keyframes().size() < before_.keyframes().size() + 8) {
    ring_.go_on(map_, walk_);
    saw[newest_of(map_)] = count_observations(map_, newest_of(map_));
  }
  const Map welded = map_;
  ASSERT_TRUE(std::ranges::any_of(saw, [&](const auto& entry) {
    return map_.keyframe(entry.first).covisible.contains(KeyframeId{12});
  })) << "the test tests nothing: they see only what is new";
  map_.apply(make_revocation(map_, ring_.camera(), effect_));
  expect_as_before(map_, before_, 1e-9);
  for (const auto& [id, seen] : saw) {
    const KeyframeId parent = map_.keyframe(id).parent;
    const auto relative = [&](const Map& m) {
      return m.keyframe(id).T_camera_world * m.keyframe(parent).T_camera_world.inverse();
    };
    EXPECT_LT((relative(map_) * relative(welded).inverse()).log().norm(), 1e-9);
    EXPECT_GT(count_observations(map_, id), 0.9 * seen);
    for (const auto& [other, shared] : map_.keyframe(id).covisible)
      EXPECT_FALSE(index(other) < 24 && shared > 5) << index(other) << ' ' << shared;
  }
  EXPECT_LT(largest_error_px(map_, ring_.camera()), 20) << "somebody sees what is not there";
  EXPECT_GT(largest_error_px(welded, ring_.camera()), 0);
}

TEST_P(Revocation, WhatWasRemovedMeanwhileIsNoHindrance) {
  close();
  for (const KeyframeId gone : {KeyframeId{10}, KeyframeId{56}, KeyframeId{20}})
    map_.remove_keyframe(gone);
  const LandmarkId into = map_.current_id(effect_.fusions.fusions.front().undo.from);
  map_.remove_landmark(into);
  map_.apply(make_revocation(map_, ring_.camera(), effect_));
  for (const auto& [id, keyframe] : map_.keyframes()) {
    const SE3& was = before_.keyframe(id).T_camera_world;
    EXPECT_LT((keyframe.T_camera_world * was.inverse()).log().norm(), 1e-9);
  }
  EXPECT_LT(largest_error_px(map_, ring_.camera()), 20);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Revocation, testing::Values(1, 2, 3));

/// In a part of the second lap every other point stands 0.2 m from where it stood in the first; the
/// points between, which the first lap did not see, vouch for the odometry.
class WrongLoop : public testing::Test {
 protected:
  static constexpr int kShow = 36, kLap = 42, kPart = 52, kEnd = 68;

  void SetUp() override {
    for (std::size_t i = 1; i < points().size(); i += 2) points()[i].p_world.z() += 1e3;
    map_ = ring_.walk(walk_);
    for (std::size_t i = 1; i < points().size(); i += 2) points()[i].p_world.z() -= 1e3;
    while (next() < kLap) map_next();
  }
  [[nodiscard]] std::vector<map_test::WorldPoint>& points() { return ring_.world().points(); }
  [[nodiscard]] int next() const { return static_cast<int>(index(map_.next_keyframe_id())); }
  void shift_what_is_known(double by_m) {
    for (std::size_t i = 0; i < points().size(); i += 2) points()[i].p_world.x() += by_m;
    has_shifted_ = true;
  }

  void map_next() {
    const bool is_first = std::exchange(has_shifted_, false);
    ring_.go_on(map_, walk_, [&](int point) { return !is_first || point % 2 == 1; });
    const LoopResult result = closer_->step(map_, made_index(map_), newest_of(map_));
    for (const LoopAttempt& attempt : result.attempts) ++outcomes_[attempt.outcome];
    if (!result.closure) return;
    if (result.closure->revocation) map_.apply(*result.closure->revocation);
    map_.apply(result.closure->patch);
    closer_->remember(*result.closure, weld(map_, ring_, *result.closure));
  }
  [[nodiscard]] double error_m(KeyframeId id) const {
    const Vec3 truth = RingWorld::true_pose(walk_, static_cast<int>(index(id))).inverse().t();
    return (map_.keyframe(id).position_world() - truth).norm();
  }
  /// Keyframes of the second lap that share landmarks with those of the first half of the first.
  [[nodiscard]] bool is_welded(int from, int to) const {
    for (int i = from; i < to; ++i)
      for (const auto& [other, shared] : map_.keyframe(KeyframeId(i)).covisible)
        if (index(other) < 24) return true;
    return false;
  }

  RingWorld ring_{21};
  Walk walk_{.keyframes = kShow, .drift_m = 0, .drift_rad = 0};
  Map map_{{map_test::kLevels, map_test::kScale}};
  bool has_shifted_ = false;
  std::optional<LoopCloser> closer_{std::in_place, LoopConfig{}, ring_.camera()};
  std::map<LoopOutcome, int> outcomes_;
};

TEST_F(WrongLoop, IsTakenBackWhenTwoKeyframesContradictIt) {
  shift_what_is_known(0.2);
  while (next() < kPart) map_next();
  ASSERT_EQ(outcomes_[LoopOutcome::kClosed], 1);
  ASSERT_GT(error_m(KeyframeId{kPart - 1}), 0.15) << "it was not wrong";
  ASSERT_TRUE(is_welded(kLap, kPart));
  shift_what_is_known(-0.2);
  while (next() < kEnd && outcomes_[LoopOutcome::kRevoked] == 0) map_next();
  EXPECT_EQ(outcomes_[LoopOutcome::kRevoked], 1);
  EXPECT_EQ(outcomes_[LoopOutcome::kClosed], 2);
  EXPECT_FALSE(is_welded(kLap, kPart)) << "what it fused is still one";
  for (const auto& [id, keyframe] : map_.keyframes()) EXPECT_LT(error_m(id), 0.02) << index(id);
  EXPECT_LT(largest_error_px(map_, ring_.camera()), 20);
}

TEST_F(WrongLoop, ATrueLoopIsNotTakenBackForWrongViews) {
  while (next() < kPart) map_next();
  ASSERT_GT(outcomes_[LoopOutcome::kClosed], 0);
  shift_what_is_known(0.2);
  while (next() < kPart + 6) map_next();
  EXPECT_EQ(outcomes_[LoopOutcome::kRevoked], 0);
  EXPECT_TRUE(is_welded(kLap, kPart));
  for (int i = 0; i < kPart; ++i) EXPECT_LT(error_m(KeyframeId(i)), 0.02) << i;
}

TEST_F(WrongLoop, StaysWhenItIsNotAmongTheNewestAnyMore) {
  LoopConfig config;
  config.revocable = 0;
  closer_.emplace(config, ring_.camera());
  shift_what_is_known(0.2);
  while (next() < kPart) map_next();
  ASSERT_EQ(outcomes_[LoopOutcome::kClosed], 1);
  shift_what_is_known(-0.2);
  while (next() < kEnd) map_next();
  EXPECT_EQ(outcomes_[LoopOutcome::kRevoked], 0);
}

}  // namespace
}  // namespace ygslam
