#include "map/landmark_fields.hpp"

#include <gtest/gtest.h>

#include "map/descriptor_sources.hpp"
#include "map/map_assembly.hpp"
#include "map/map_test_world.hpp"

namespace ygslam::map_fields {
namespace {

std::vector<const Landmark*> landmarks_of(const Map& map) {
  std::vector<const Landmark*> all;
  map.for_each_landmark([&](const Landmark& landmark) { all.push_back(&landmark); });
  std::ranges::sort(all, {}, &Landmark::id);
  return all;
}

class LandmarkFields : public ::testing::Test {
 protected:
  LandmarkFields() {
    ArchiveWriter out;
    landmarks(out, all_, extras_);
    bytes_ = out.bytes();
  }
  /// @return what is wrong.
  std::string read(std::span<const char> bytes) {
    ArchiveReader in(bytes);
    back_ = {};
    landmarks(in, back_, extras_back_);
    in.check_end();
    return in.ok() ? "" : in.fault();
  }

  map_test::World world_{200, 9};
  Map map_ = map_test::true_map(world_, 6).map;
  std::vector<const Landmark*> all_ = landmarks_of(map_);
  LandmarkExtras extras_ = DescriptorSources(map_).of(all_);
  std::string bytes_;
  std::vector<Landmark> back_;
  LandmarkExtras extras_back_;
};

TEST_F(LandmarkFields, ComeBackButForTheLastBitsOfDirectionsAndRanges) {
  ASSERT_EQ(read(bytes_), "");
  ASSERT_EQ(back_.size(), all_.size());
  EXPECT_EQ(extras_back_.sources, extras_.sources);
  for (std::size_t i = 0; i < back_.size(); ++i) {
    const Landmark& a = *all_[i];
    const Landmark& b = back_[i];
    EXPECT_EQ(b.id, a.id);
    EXPECT_EQ(b.p_world, a.p_world);
    EXPECT_EQ(b.normal_world, a.normal_world.cast<float>().cast<double>());
    EXPECT_EQ(b.max_distance_m, static_cast<float>(a.max_distance_m));
    EXPECT_EQ(b.min_distance_m, static_cast<float>(a.min_distance_m));
    EXPECT_EQ(b.first_keyframe, a.first_keyframe);
    EXPECT_EQ(b.visible, a.visible);
    EXPECT_EQ(b.found, a.found);
  }
  std::vector<const Landmark*> pointers;
  for (const Landmark& landmark : back_) pointers.push_back(&landmark);
  ArchiveWriter again;
  landmarks(again, pointers, extras_back_);
  EXPECT_EQ(again.bytes(), bytes_);
}

TEST_F(LandmarkFields, DescriptorsStandWithTheirObservations) {
  for (std::size_t i = 0; i < all_.size(); ++i) {
    ASSERT_LT(extras_.sources[i], all_[i]->observations.size());
    const LandmarkObservation& o = all_[i]->observations[extras_.sources[i]];
    EXPECT_EQ(map_.keyframe(o.keyframe).data->features->descriptors[o.feature],
              all_[i]->descriptor);
  }
}

TEST_F(LandmarkFields, ADescriptorThatNoObservationHasIsKept) {
  std::vector<Landmark> list;
  for (const Landmark* landmark : all_) list.push_back(*landmark);
  list[3].descriptor.bits[2] ^= 1;
  list[5].descriptor = {};
  std::vector<const Landmark*> pointers;
  for (const Landmark& landmark : list) pointers.push_back(&landmark);
  const LandmarkExtras extras = DescriptorSources(map_).of(pointers);
  EXPECT_EQ(std::ranges::count(extras.sources, kOwnDescriptor), 2);
  EXPECT_EQ(extras.sources[3], kOwnDescriptor);
  ArchiveWriter out;
  landmarks(out, pointers, extras);
  EXPECT_EQ(out.bytes().size(), bytes_.size() + 2 * sizeof(Descriptor));
  ASSERT_EQ(read(out.bytes()), "");
  EXPECT_EQ(back_[3].descriptor, list[3].descriptor);
  EXPECT_EQ(back_[5].descriptor, list[5].descriptor);
}

TEST_F(LandmarkFields, RangesThatDoNotFollowAreKept) {
  std::vector<Landmark> list;
  for (const Landmark* landmark : all_) list.push_back(*landmark);
  list[0].min_distance_m = 0;
  list[1].min_distance_m = list[1].max_distance_m;
  list[2].min_distance_m = list[2].max_distance_m = 0;
  list[3].normal_world.setZero();
  std::vector<const Landmark*> pointers;
  for (const Landmark& landmark : list) pointers.push_back(&landmark);
  ArchiveWriter out;
  landmarks(out, pointers, extras_);
  ASSERT_EQ(read(out.bytes()), "");
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(back_[i].min_distance_m, static_cast<float>(list[i].min_distance_m));
    EXPECT_EQ(back_[i].max_distance_m, static_cast<float>(list[i].max_distance_m));
  }
  EXPECT_EQ(back_[3].normal_world, Vec3::Zero());
}

TEST_F(LandmarkFields, DamageIsSeen) {
  for (std::size_t length = 0; length < bytes_.size(); length += 1 + bytes_.size() / 301)
    EXPECT_NE(read(std::span(bytes_).first(length)), "") << length;
  std::string damaged = bytes_;
  const double none = 0.5;
  std::memcpy(damaged.data() + 4, &none, sizeof(none));
  EXPECT_EQ(read(damaged), "a pyramid of no size");
  extras_back_.most = all_.size() - 1;
  EXPECT_EQ(read(bytes_), "cut short, or a count too large");
}

}  // namespace
}  // namespace ygslam::map_fields
