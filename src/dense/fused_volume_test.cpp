#include "dense/fused_volume.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "geometry/properties_testing.hpp"

#include "dense/pose_distance.hpp"
#include "volume/volume_test_world.hpp"

namespace ygslam {
namespace {

using volume_test::look_at;
using volume_test::World;

constexpr std::uint32_t kViews = 5;

World small_room() {
  World world;
  world.cuboids = {{Vec3(-0.3, 0.5, -0.3), Vec3(0.3, 1.2, 0.3), SceneObjectId{1}}};
  return world;
}

SE3 pose_of(std::uint32_t i, double off_m = 0) {
  const double angle = 0.5 * i;
  return look_at(Vec3(1.2 * std::sin(angle) + off_m, -0.4, -1.2 * std::cos(angle)),
                 Vec3(0, 0.6, 0));
}

struct Images {
  std::vector<std::shared_ptr<const StoredView>> of;
  Images() {
    for (std::uint32_t i = 0; i < kViews; ++i) {
      DepthView view =
          volume_test::render(small_room(), pose_of(i), i, {70, 70, 39.5, 29.5, 80, 60});
      of.push_back(std::make_shared<const StoredView>(view));
    }
  }
};
const Images& images() {
  static const Images kImages;
  return kImages;
}

/// A view where it is, with its object under the number 9.
ViewPlacement placed(std::uint32_t i, double off_m = 0) {
  ViewPlacement view{images().of[i], Timestamp{i}, pose_of(i, off_m), {}};
  view.state.ids = {SceneObjectId{9}};
  return view;
}

/// Cells of the space layer on the box's near side and in the air before it.
std::vector<SpaceIndex> some_cells(int count) {
  std::vector<SpaceIndex> cells;
  for (int i = 0; i < count; ++i) cells.emplace_back(i % 4 - 2, 10 + i / 4, -7);
  return cells;
}

PixelState some_state(std::uint32_t kind) {
  PixelState state;
  state.ids = {kind % 4 == 3 ? kRemovedObject
                             : SceneObjectId{static_cast<std::uint16_t>(kind % 4)}};
  if (kind / 4 % 2 == 1)
    state.appeared = std::make_shared<const std::vector<SpaceIndex>>(some_cells(8));
  if (kind / 8 % 2 == 1) {
    std::vector<CellKey> keys;
    for (const SpaceIndex& cell : some_cells(16))
      keys.push_back(cell_key((cell.cast<double>() + Vec3::Constant(0.5)) * 0.05, 0.05));
    std::sort(keys.begin(), keys.end());
    state.removed = std::make_shared<const std::vector<CellKey>>(keys);
    if (kind / 16 % 2 == 1) state.removed_objects = {state.removed};
  }
  return state;
}
constexpr std::uint32_t kStates = 32;

FusedVolume empty_volume() { return {{}, std::make_shared<ViewUnpacker>()}; }

FusedVolume::Placements all_views() {
  FusedVolume::Placements all;
  for (std::uint32_t i = 0; i < kViews; ++i) all.emplace(KeyframeId{i}, placed(i));
  return all;
}

/// The same, put into an empty one.
std::uint64_t fingerprint_of(const FusedVolume::Placements& placements) {
  FusedVolume fused = empty_volume();
  for (const auto& [id, placement] : placements) fused.sync(id, placement);
  return fused.volume().fingerprint();
}

/// Whatever order views were added, removed, moved and judged in: what is wanted at the end
/// decides.
RC_GTEST_PROP(FusedVolumeProperty, IsAPureFunctionOfWhatIsWanted, ()) {
  FusedVolume fused = empty_volume();
  FusedVolume::Placements wanted;
  const auto steps = *rc::gen::inRange(1, 12);
  for (int step = 0; step < steps; ++step) {
    const auto i = *rc::gen::inRange<std::uint32_t>(0, kViews);
    const auto state = *rc::gen::inRange<std::uint32_t>(0, kStates);
    const auto off_mm = *rc::gen::element(0, 0, 3, 40);
    ViewPlacement placement = placed(i, 1e-3 * off_mm);
    placement.state = some_state(state);
    switch (*rc::gen::inRange(0, 4)) {
      case 0:
        wanted.erase(KeyframeId{i});
        fused.remove(KeyframeId{i});
        break;
      case 1:  // many at once, as at the end of a run
        wanted.insert_or_assign(KeyframeId{i}, placement);
        if (*rc::gen::arbitrary<bool>()) wanted.erase(wanted.begin());
        fused.sync(wanted);
        break;
      default:
        wanted.insert_or_assign(KeyframeId{i}, placement);
        fused.sync(KeyframeId{i}, placement);
    }
  }
  RC_ASSERT(fused.volume().views() == static_cast<int>(wanted.size()));
  RC_ASSERT(fused.volume().fingerprint() == fingerprint_of(wanted));
  FusedVolume direct = empty_volume();
  direct.sync(wanted);
  RC_ASSERT(fused.mesh().triangles == direct.mesh().triangles);
}

/// What a view observed of space does not depend on what was put in since, nor on how it is known.
RC_GTEST_PROP(FusedVolumeProperty, ObservedSpaceIsThatOfTheViewByItself, ()) {
  const auto i = *rc::gen::inRange<std::uint32_t>(0, kViews);
  ViewPlacement placement = placed(i);
  FusedVolume fused = empty_volume();
  const auto changes = *rc::gen::inRange(1, 4);
  for (int change = 0; change < changes; ++change) {
    placement.state = some_state(*rc::gen::inRange<std::uint32_t>(0, kStates));
    fused.sync(KeyframeId{i}, placement);
    fused.sync(KeyframeId{(i + 1) % kViews}, placed((i + 1) % kViews));
    if (*rc::gen::arbitrary<bool>()) static_cast<void>(fused.observed_space(KeyframeId{i}));
  }
  ViewPlacement bare = placement;
  bare.state = space_state(bare.state);
  FusedVolume other = empty_volume();
  const SeenSpace expected = other.observe(bare);
  const SeenSpace& observed = fused.observed_space(KeyframeId{i});
  RC_ASSERT(observed.size() == expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    RC_ASSERT(observed.key(k) == expected.key(k));
    RC_ASSERT(observed.hits(k) == expected.hits(k));
    RC_ASSERT(observed.through(k) == expected.through(k));
  }
  RC_ASSERT(other.volume().views() == 0);
}

TEST(FusedVolume, SyncOfAllTakesOutWhatIsNotWanted) {
  FusedVolume fused = empty_volume();
  fused.sync(all_views());
  EXPECT_EQ(fused.volume().views(), static_cast<int>(kViews));
  FusedVolume::Placements fewer = all_views();
  fewer.erase(KeyframeId{1});
  fused.sync(fewer);
  EXPECT_FALSE(fused.contains(KeyframeId{1}));
  EXPECT_EQ(fused.find(KeyframeId{1}), nullptr);
  EXPECT_EQ(fused.volume().fingerprint(), fingerprint_of(fewer));
  fused.sync(FusedVolume::Placements{});
  EXPECT_EQ(fused.volume().views(), 0);
  EXPECT_EQ(fused.volume().fingerprint(), empty_volume().volume().fingerprint());
}

TEST(FusedVolume, MovesAViewThatIsFartherOffThanTolerated) {
  FusedVolume fused = empty_volume();
  fused.sync(KeyframeId{0}, placed(0));
  const std::uint64_t before = fused.volume().fingerprint();
  fused.sync(KeyframeId{0}, placed(0, 0.002), 0.01);
  EXPECT_EQ(fused.volume().fingerprint(), before);
  EXPECT_TRUE(same(fused.find(KeyframeId{0})->T_world_camera, pose_of(0)));
  ViewPlacement renamed = placed(0, 0.002);
  renamed.state.ids = {SceneObjectId{10}};
  fused.sync(KeyframeId{0}, renamed, 0.01);
  EXPECT_TRUE(same(fused.find(KeyframeId{0})->T_world_camera, pose_of(0)))
      << "its pixels show something else: they are exchanged where the view stands";
  ViewPlacement there = renamed;
  there.T_world_camera = pose_of(0);
  EXPECT_EQ(fused.volume().fingerprint(), fingerprint_of({{KeyframeId{0}, there}}));
  fused.sync(KeyframeId{0}, placed(0, 0.0021));
  EXPECT_TRUE(same(fused.find(KeyframeId{0})->T_world_camera, pose_of(0, 0.0021)));
}

TEST(FusedVolume, CellsThatMustNotBeCarvedAreExchangedWhereTheViewStands) {
  FusedVolume fused = empty_volume();
  for (const auto& [id, placement] : all_views()) fused.sync(id, placement);
  ViewPlacement spared = placed(2, 0.001);
  spared.state.appeared = std::make_shared<const std::vector<SpaceIndex>>(some_cells(12));
  fused.sync(KeyframeId{2}, spared, 0.01);
  EXPECT_TRUE(same(fused.find(KeyframeId{2})->T_world_camera, pose_of(2)));
  FusedVolume::Placements expected = all_views();
  expected.at(KeyframeId{2}).state.appeared = spared.state.appeared;
  EXPECT_EQ(fused.volume().fingerprint(), fingerprint_of(expected));
}

TEST(FusedVolume, ViewsAddedByTheWayGoWithTheNextSync) {
  FusedVolume fused = empty_volume();
  fused.sync(all_views());
  const std::uint64_t before = fused.volume().fingerprint();
  DepthView plain = images().of[0]->restored();
  plain.objects.clear();
  std::fill(plain.object.begin(), plain.object.end(), DepthView::kNothing);
  ASSERT_TRUE(fused.add(plain, pose_of(0, 0.1)));
  ASSERT_TRUE(fused.add(plain, pose_of(0, 0.2)));
  EXPECT_EQ(fused.volume().views(), static_cast<int>(kViews) + 2);
  const std::vector<DenseViewId> ids = fused.ids();
  ASSERT_EQ(ids.size(), kViews + 2);
  EXPECT_EQ(ids.back().keyframe, kNoKeyframe) << "after all others";
  EXPECT_NE(ids.back(), ids[kViews]);
  EXPECT_EQ(fused.pixels(ids.back()).depth.size(), plain.depth.size());
  fused.sync(all_views());
  EXPECT_EQ(fused.volume().fingerprint(), before);
}

TEST(FusedVolume, PixelsOfAViewAreThoseThatWentIn) {
  FusedVolume fused = empty_volume();
  ViewPlacement view = placed(0);
  fused.sync(KeyframeId{0}, view);
  EXPECT_EQ(fused.pixels(KeyframeId{0}).objects, (std::vector{SceneObjectId{9}}));
  const DepthView whole = fused.pixels(KeyframeId{0});
  const auto shown = [](const DepthView& pixels) {
    return std::count(pixels.object.begin(), pixels.object.end(), 1);
  };
  ASSERT_GT(shown(whole), 100);
  view.state.ids = {kRemovedObject};
  fused.sync(KeyframeId{0}, view);
  const DepthView removed = fused.pixels(KeyframeId{0});
  EXPECT_EQ(shown(removed), 0);
  EXPECT_GT(std::count(removed.object.begin(), removed.object.end(), DepthView::kExcluded),
            shown(whole));
}

TEST(FusedVolume, ASceneOfOneViewIsShownAllTheSame) {
  FusedVolume fused = empty_volume();
  EXPECT_TRUE(fused.mesh().vertices.empty());
  fused.sync(KeyframeId{0}, placed(0));
  EXPECT_GT(fused.mesh().vertices.size(), 500U);
  fused.sync(KeyframeId{3}, placed(3));
  const std::size_t of_two = fused.mesh().vertices.size();
  fused.remove(KeyframeId{3});
  EXPECT_NE(fused.mesh().vertices.size(), of_two) << "two views must agree where there are two";
  const std::size_t bytes = fused.memory_bytes();
  static_cast<void>(fused.observed_space(KeyframeId{0}));
  EXPECT_GE(fused.memory_bytes(), bytes);
}

}  // namespace
}  // namespace ygslam
