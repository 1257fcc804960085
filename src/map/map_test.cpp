#include "map/map.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <set>

#include "geometry/random_vector.hpp"
#include "map/map_test_world.hpp"

namespace ygslam {
namespace {

using map_test::World;

/// Everything that must hold of any map, counted by brute force.
void expect_consistent(const Map& map, const std::vector<LandmarkId>& ever_made) {
  std::set<LandmarkId> alive;
  for (const LandmarkId id : ever_made)
    if (map.has_landmark(id)) alive.insert(id);
  ASSERT_EQ(alive.size(), map.landmark_count());
  for (const LandmarkId id : alive) {
    const Landmark& landmark = map.landmark(id);
    ASSERT_EQ(landmark.id, id);
    ASSERT_FALSE(landmark.observations.empty());
    for (std::size_t i = 0; i < landmark.observations.size(); ++i) {
      const LandmarkObservation& o = landmark.observations[i];
      ASSERT_TRUE(map.has_keyframe(o.keyframe));
      ASSERT_EQ(map.keyframe(o.keyframe).landmarks[o.feature], id);
      if (i > 0) {
        ASSERT_LT(landmark.observations[i - 1].keyframe, o.keyframe);
      }
    }
  }
  for (const auto& [id, keyframe] : map.keyframes()) {
    std::set<LandmarkId> mine;
    for (std::uint32_t f = 0; f < keyframe.landmarks.size(); ++f) {
      const LandmarkId landmark = keyframe.landmarks[f];
      if (landmark == kNoLandmark) continue;
      ASSERT_TRUE(alive.contains(landmark));
      ASSERT_TRUE(mine.insert(landmark).second) << "twice in one keyframe";
      const auto& observations = map.landmark(landmark).observations;
      ASSERT_TRUE(std::any_of(observations.begin(), observations.end(),
                              [&](const auto& o) { return o.keyframe == id && o.feature == f; }));
    }
    std::map<KeyframeId, int> shared;
    for (const auto& [other_id, other] : map.keyframes()) {
      if (other_id == id) continue;
      for (const LandmarkId landmark : other.landmarks)
        if (landmark != kNoLandmark && mine.contains(landmark)) ++shared[other_id];
    }
    ASSERT_EQ(keyframe.covisible, shared);
    ASSERT_TRUE(keyframe.parent == kNoKeyframe || map.has_keyframe(keyframe.parent));
  }
}

/// Plays random operations on a map; remembers where fused landmarks must lead.
class RandomEditor {
 public:
  explicit RandomEditor(std::uint64_t seed) : world_(60, seed), rng_(seed) {}

  void step() {
    switch (rng_.below(10)) {
      case 0:
        return add_keyframe();
      case 1:
        return remove_keyframe();
      case 2:
        return remove_landmark();
      case 3:
        return fuse();
      case 4:
        return remove_observation();
      case 5:
        return move();
      default:
        return observe();
    }
  }

  Map map{{map_test::kLevels, map_test::kScale}};
  std::vector<LandmarkId> made;
  std::map<LandmarkId, LandmarkId> fused;
  std::map<KeyframeId, SE3> removed_pose;

 private:
  template <typename T>
  T pick(const std::vector<T>& from) {
    return from[rng_.below(static_cast<std::uint32_t>(from.size()))];
  }
  std::vector<KeyframeId> keyframes() const {
    std::vector<KeyframeId> ids;
    for (const auto& [id, keyframe] : map.keyframes()) ids.push_back(id);
    return ids;
  }
  std::vector<LandmarkId> alive() const {
    std::vector<LandmarkId> ids;
    for (const LandmarkId id : made)
      if (map.has_landmark(id)) ids.push_back(id);
    return ids;
  }
  void add_keyframe() {
    const auto seen = world_.see(World::pose(static_cast<int>(rng_.below(12))), count_++);
    const auto known = keyframes();
    map_test::add_keyframe(map, seen, known.empty() ? kNoKeyframe : pick(known));
  }
  void remove_keyframe() {
    const auto known = keyframes();
    if (known.size() < 3) return;
    const KeyframeId id = pick(known);
    if (map.keyframe(id).parent == kNoKeyframe) return;
    removed_pose[id] = map.keyframe(id).T_camera_world;
    map.remove_keyframe(id);
  }
  void remove_landmark() {
    const auto ids = alive();
    if (!ids.empty()) map.remove_landmark(pick(ids));
  }
  void fuse() {
    const auto ids = alive();
    if (ids.size() < 2) return;
    const LandmarkId from = pick(ids), into = pick(ids);
    if (from == into) return;
    map.fuse(from, into);
    fused[from] = into;
  }
  void remove_observation() {
    const auto ids = alive();
    const auto known = keyframes();
    if (ids.empty()) return;
    const KeyframeId keyframe = pick(known);
    map.remove_observation(pick(ids), keyframe);  // may be none of its own
  }
  void move() {
    const auto ids = alive();
    if (ids.empty()) return;
    const Vec3 p = random_normals<2>(rng_).homogeneous() + Vec3(0, 0, 2);
    map.set_position(pick(ids), p);
  }
  void observe() {
    const auto known = keyframes();
    if (known.empty()) return add_keyframe();
    const KeyframeId id = pick(known);
    const auto features = static_cast<std::uint32_t>(map.keyframe(id).landmarks.size());
    if (!features) return;
    const std::uint32_t feature = rng_.below(features);
    const auto ids = alive();
    if (ids.empty() || rng_.below(3) == 0) {
      if (map.keyframe(id).landmarks[feature] != kNoLandmark) return;
      const Vec3 p = random_normals<2>(rng_).homogeneous() + Vec3(0, 0, 2);
      made.push_back(map.add_landmark(p, id, feature));
      return;
    }
    const LandmarkId landmark = pick(ids);
    const bool free = map.keyframe(id).landmarks[feature] == kNoLandmark;
    const auto& observations = map.landmark(landmark).observations;
    const bool unseen = std::none_of(observations.begin(), observations.end(),
                                     [&](const auto& o) { return o.keyframe == id; });
    ASSERT_EQ(map.add_observation(landmark, id, feature), free && unseen);
  }

  World world_;
  Rng rng_;
  std::uint32_t count_ = 0;
};

TEST(Map, StaysConsistentUnderRandomEdits) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomEditor editor(seed);
    for (int i = 0; i < 300; ++i) {
      editor.step();
      if (i % 25 == 0) expect_consistent(editor.map, editor.made);
      if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed << " step " << i;
    }
    expect_consistent(editor.map, editor.made);
  }
}

TEST(Map, CurrentIdFollowsFusionsToTheLandmarkThatIsLeft) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    RandomEditor editor(seed);
    for (int i = 0; i < 300; ++i) editor.step();
    for (const LandmarkId id : editor.made) {
      LandmarkId expected = id;
      while (!editor.map.has_landmark(expected) && editor.fused.contains(expected))
        expected = editor.fused.at(expected);
      if (!editor.map.has_landmark(expected)) expected = kNoLandmark;
      ASSERT_EQ(editor.map.current_id(id), expected);
    }
  }
}

TEST(Map, ALandmarkThatNobodySeesAnyMoreIsAChange) {
  World world(60, 3);
  Map map = map_test::true_map(world, 1).map;
  const LandmarkId id = map.keyframe(KeyframeId{0}).landmarks.front();
  const auto before = map.version();
  map.remove_observation(id, KeyframeId{0});
  EXPECT_FALSE(map.has_landmark(id));
  EXPECT_GT(map.version(), before);
}

TEST(Map, FusionKeepsEveryKeyframeThatSawEither) {
  World world(100, 3);
  auto truth = map_test::true_map(world, 4);
  // Two landmarks of one point: one seen by keyframes 0 and 1, the other by 2 and 3.
  const LandmarkId a = truth.landmark[truth.seen[0].point[5]];
  ASSERT_EQ(truth.map.landmark(a).observations.size(), 4U);
  const auto all = truth.map.landmark(a).observations;
  truth.map.remove_observation(a, all[2].keyframe);
  truth.map.remove_observation(a, all[3].keyframe);
  const LandmarkId b = truth.map.add_landmark(Vec3(0, 0, 3), all[2].keyframe, all[2].feature);
  ASSERT_TRUE(truth.map.add_observation(b, all[3].keyframe, all[3].feature));
  truth.map.count_seen(b, 5, 3);
  truth.map.fuse(b, a);
  EXPECT_FALSE(truth.map.has_landmark(b));
  EXPECT_EQ(truth.map.current_id(b), a);
  ASSERT_EQ(truth.map.landmark(a).observations.size(), 4U);
  EXPECT_EQ(truth.map.landmark(a).visible, 1 + 1 + 5);
  EXPECT_EQ(truth.map.landmark(a).found, 1 + 1 + 3);
}

TEST(Map, ARemovedKeyframeFollowsItsAncestors) {
  World world(80, 4);
  auto truth = map_test::true_map(world, 6);
  std::vector<SE3> before;
  for (std::uint32_t i = 0; i < 6; ++i) before.push_back(truth.map.resolved_pose(KeyframeId{i}));
  for (const std::uint32_t id : {3U, 2U, 4U}) truth.map.remove_keyframe(KeyframeId{id});
  // A chain of removed ancestors still leads to the pose it had.
  for (std::uint32_t i = 0; i < 6; ++i) {
    const SE3 difference = truth.map.resolved_pose(KeyframeId{i}) * before[i].inverse();
    EXPECT_LT(difference.log().norm(), 1e-12) << i;
  }
  EXPECT_EQ(truth.map.keyframe(KeyframeId{5}).parent, KeyframeId{1});
  // The ancestor is corrected: the removed move with it, rigidly.
  Vec6 twist;
  twist << 0.1, -0.2, 0.05, 0.02, 0.03, -0.01;
  const SE3 T_new_old = SE3::exp(twist);
  truth.map.set_pose(KeyframeId{1}, before[1] * T_new_old);
  for (const std::uint32_t id : {2U, 3U, 4U}) {
    const SE3 expected = before[id] * T_new_old;
    EXPECT_LT((truth.map.resolved_pose(KeyframeId{id}) * expected.inverse()).log().norm(), 1e-9);
  }
}

/// A keyframe without features, as frame 10 id.
KeyframeDataPtr bare_keyframe(std::uint32_t id) {
  static const auto features = std::make_shared<const Features>();
  return std::make_shared<KeyframeData>(
      KeyframeData{KeyframeId{id}, FrameId{10 * id}, {}, features, FeatureGrid()});
}

TEST(Map, ASubmapHasARootOfItsOwnUntilItIsJoined) {
  World world(100, 5);
  Map map({map_test::kLevels, map_test::kScale});
  const auto add = [&](std::uint32_t number, KeyframeId parent) {
    return map_test::add_keyframe(map, world.see(SE3(), number), parent);
  };
  const KeyframeId first = add(0, kNoKeyframe);
  const KeyframeId second = add(1, first);
  const KeyframeId root = add(2, kNoKeyframe);
  const KeyframeId gone = add(3, root);
  const KeyframeId last = add(4, gone);
  map.remove_keyframe(gone);
  EXPECT_EQ(map.origin(), first);
  EXPECT_EQ(map.root_of(second), first);
  EXPECT_EQ(map.root_of(last), root);
  EXPECT_EQ(map.nearest_kept(gone), root);
  EXPECT_EQ(map.roots(), (std::map<KeyframeId, KeyframeId>{
                             {first, first}, {second, first}, {root, root}, {last, root}}));
  EXPECT_EQ(map.main_root(), first) << "of two as large the older";
  const KeyframeId newest = add(5, last);
  EXPECT_EQ(map.main_root(), root);
  map.forget_frames();
  EXPECT_EQ(map.main_root(), first) << "the world that was there before this run";
  map.join(root, second);
  EXPECT_EQ(map.root_of(newest), first);
  EXPECT_EQ(map.main_root(), first);
}

TEST(Map, AMotionBeginsAtAKeyframeThatIsThere) {
  Rng rng(8);
  Map map({8, 1.2});
  const auto pose = [&]() -> SE3 {
    Vec6 twist;
    for (int i = 0; i < 6; ++i) twist[i] = rng.uniform(-1, 1);
    return SE3::exp(twist);
  };
  for (std::uint32_t id = 0; id < 4; ++id)
    map.add_keyframe(bare_keyframe(id), pose(), id ? KeyframeId{id - 1} : kNoKeyframe, {});
  const auto motion_to = [&](std::uint32_t from, std::uint32_t to) -> KeyframeMotion {
    return {KeyframeId{from},
            map.resolved_pose(KeyframeId{to}) * map.resolved_pose(KeyframeId{from}).inverse(),
            Mat6::Identity()};
  };
  const auto expect_motion = [&](std::uint32_t from, std::uint32_t to) {
    const auto& motion = map.keyframe(KeyframeId{to}).motion;
    ASSERT_TRUE(motion);
    EXPECT_EQ(motion->from, KeyframeId{from});
    EXPECT_LT(
        (motion->T_keyframe_from * motion_to(from, to).T_keyframe_from.inverse()).log().norm(),
        1e-6);
  };
  map.set_motion(KeyframeId{3}, motion_to(2, 3));
  expect_motion(2, 3);
  map.remove_keyframe(KeyframeId{2});
  expect_motion(1, 3);
  map.set_motion(KeyframeId{3}, motion_to(2, 3));  // that went before the tracker heard of it
  expect_motion(1, 3);
  map.set_motion(KeyframeId{1}, {kNoKeyframe, motion_to(0, 1).T_keyframe_from, Mat6::Identity()});
  expect_motion(0, 1);
}

TEST(Map, AMotionOutlivesTheKeyframeThatItLedTo) {
  Map map({8, 1.2});
  const SE3 turn(so3_exp({0, 0.3, 0}), Vec3(0, 0, 0.2));
  std::vector<SE3> poses = {SE3()};
  for (int i = 1; i < 5; ++i) poses.push_back(turn * poses.back());
  for (std::uint32_t id = 0; id < 5; ++id)
    map.add_keyframe(bare_keyframe(id), poses[id], id ? KeyframeId{id - 1} : kNoKeyframe, {});
  Vec6 variances;
  variances << 1, 2, 3, 4, 5, 6;
  const Mat6 covariance = variances.asDiagonal();
  map.set_motion(KeyframeId{2}, {KeyframeId{1}, turn, covariance});
  map.remove_keyframe(KeyframeId{2});
  const auto& motion = map.keyframe(KeyframeId{3}).motion;
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->from, KeyframeId{1});
  EXPECT_LT((motion->T_keyframe_from * (turn * turn).inverse()).log().norm(), 1e-9);
  EXPECT_LT((motion->covariance - turn.adjoint() * covariance * turn.adjoint().transpose()).norm(),
            1e-9);
  EXPECT_FALSE(map.keyframe(KeyframeId{4}).motion) << "it was seen from the one before";
}

TEST(Map, ThousandsOfRemovedKeyframesKeepTheirPlaceAndCostLittle) {
  constexpr std::uint32_t kGenerations = 5000;
  constexpr std::size_t kStay = 10;
  Rng rng(7);
  Map map({8, 1.2});
  map.add_keyframe(bare_keyframe(0), SE3(), kNoKeyframe, {});
  std::vector<SE3> poses = {SE3()};
  poses.reserve(kGenerations + 1);
  const std::size_t before = mallinfo2().uordblks;
  for (std::uint32_t id = 1; id <= kGenerations; ++id) {
    Vec6 twist;
    for (int i = 0; i < 6; ++i) twist[i] = rng.uniform(-1, 1);
    poses.push_back(SE3::exp(twist));
    map.add_keyframe(bare_keyframe(id), poses.back(), map.keyframes().rbegin()->first, {});
    if (map.keyframes().size() <= kStay) continue;
    auto old = std::next(map.keyframes().begin(), 1 + rng.below(kStay - 1));  // any but the first
    map.remove_keyframe(old->first);
  }
  // 64 bytes each, 8 for its frame, and what the allocator and ten keyframes take.
  EXPECT_LT(mallinfo2().uordblks - before, kGenerations * 80U);
  ASSERT_EQ(map.removed_keyframes().size() + map.keyframes().size(), poses.size());
  for (const RemovedKeyframe& removed : map.removed_keyframes())
    ASSERT_TRUE(map.has_keyframe(removed.parent)) << "the way to a pose is one step";
  for (std::uint32_t id = 0; id <= kGenerations; ++id) {
    const SE3 difference = map.resolved_pose(KeyframeId{id}) * poses[id].inverse();
    ASSERT_LT(difference.log().norm(), 1e-9) << id;
    ASSERT_EQ(map.keyframe_of(FrameId{10 * id}), KeyframeId{id});
    ASSERT_EQ(map.keyframe_of(FrameId{10 * id + 1}), kNoKeyframe);
  }
}

TEST(Map, RefreshTakesTheMostTypicalDescriptorAndTheMeanDirection) {
  World world(60, 5);
  auto truth = map_test::true_map(world, 5);
  int checked = 0;
  for (std::size_t p = 0; p < truth.landmark.size(); ++p) {
    if (truth.landmark[p] == kNoLandmark) continue;
    const Landmark& landmark = truth.map.landmark(truth.landmark[p]);
    EXPECT_LT(distance(landmark.descriptor, world.points()[p].descriptor), 13);
    EXPECT_NEAR(landmark.normal_world.norm(), 1.0, 1e-9);
    for (const auto& o : landmark.observations) {
      const Keyframe& keyframe = truth.map.keyframe(o.keyframe);
      const Vec3 ray = landmark.p_world - keyframe.position_world();
      EXPECT_GT(ray.normalized().dot(landmark.normal_world), 0.9);
      EXPECT_GE(ray.norm(), 0.7 * landmark.min_distance_m);
      EXPECT_LE(ray.norm(), 1.3 * landmark.max_distance_m);
    }
    ++checked;
  }
  EXPECT_GT(checked, 20);
}

TEST(Map, CovisibleRanksByWhatIsShared) {
  World world(300, 6);
  const auto truth = map_test::true_map(world, 8);
  const auto ids = truth.map.covisible(KeyframeId{4}, 1, 100);
  const auto& shared = truth.map.keyframe(KeyframeId{4}).covisible;
  ASSERT_EQ(ids.size(), shared.size());
  for (std::size_t i = 1; i < ids.size(); ++i) EXPECT_GE(shared.at(ids[i - 1]), shared.at(ids[i]));
  EXPECT_EQ(truth.map.covisible(KeyframeId{4}, 1, 2).size(), 2U);
  const int limit = shared.at(ids[2]);
  for (const KeyframeId id : truth.map.covisible(KeyframeId{4}, limit, 100))
    EXPECT_GE(shared.at(id), limit);
}

TEST(Landmark, WeighsLessTheMoreOftenItIsMissed) {
  Landmark landmark;
  EXPECT_EQ(landmark.static_weight(), 1.0F);
  landmark.visible = 100;
  landmark.found = 70;
  EXPECT_EQ(landmark.static_weight(), 1.0F);
  landmark.found = 30;
  EXPECT_NEAR(landmark.static_weight(), 0.5F, 1e-6F);
  landmark.found = 0;
  EXPECT_EQ(landmark.static_weight(), 0.0F);
}

}  // namespace
}  // namespace ygslam
