#include "segment/movable.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace ygslam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;

std::vector<int> classes(const std::vector<std::string>& names) {
  const auto result = MovableClasses::of_names(names);
  EXPECT_TRUE(result.ok());
  return result.ok() ? result->named() : std::vector<int>{};
}

TEST(CocoClasses, AreEightyDistinctNamesWithPersonFirst) {
  EXPECT_EQ(coco_class_name(0), "person");
  EXPECT_EQ(coco_class_name(-1), "unknown");
  EXPECT_EQ(coco_class_name(80), "unknown");
  const auto& names = coco_class_names();
  EXPECT_EQ(names.size(), 80U);
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), 80U);
  EXPECT_EQ(names[0], "person");
  EXPECT_EQ(names[16], "dog");
  EXPECT_EQ(names[56], "chair");
  EXPECT_EQ(names[79], "toothbrush");
}

TEST(MovableClasses, EveryNameGivesItsOwnId) {
  const auto& names = coco_class_names();
  for (int i = 0; i < 80; ++i) EXPECT_THAT(classes({names[i]}), ElementsAre(i));
}

TEST(MovableClasses, AreAscendingAndUniqueWhateverTheOrder) {
  EXPECT_THAT(classes({"dog", "person", "dog"}), ElementsAre(0, 16));
  const auto both = classes({"animals", "dog", "person"});
  EXPECT_TRUE(std::is_sorted(both.begin(), both.end()));
  EXPECT_EQ(both.size(), 11U);
}

TEST(MovableClasses, GroupsHoldWhatTheirNamesSay) {
  EXPECT_THAT(classes({"animals"}), ElementsAre(14, 15, 16, 17, 18, 19, 20, 21, 22, 23));
  EXPECT_THAT(classes({"vehicles"}), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(classes({"furniture"}), IsSupersetOf({56, 57, 60}));
  EXPECT_THAT(classes({"handheld"}), IsSupersetOf({24, 39, 41, 63, 67, 73}));
  EXPECT_THAT(classes({}), ElementsAre());
}

TEST(MovableClasses, UnknownNameIsAConfigurationErrorThatNamesTheNearest) {
  for (const auto& [wrong, nearest] :
       {std::pair{"persn", "'person'"}, {"animal", "'animals'"}, {"cellphone", "'cell phone'"}}) {
    const auto result = MovableClasses::of_names(std::vector<std::string>{"dog", wrong});
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().kind, ErrorKind::kConfig);
    EXPECT_THAT(result.error().message, HasSubstr(wrong));
    EXPECT_THAT(result.error().message, HasSubstr(nearest));
  }
}

TEST(MovableClasses, PersonsAndAnimalsAreSoWhateverSettingsName) {
  for (const std::vector<int>& named : {std::vector<int>{}, {0}, {56}}) {
    const MovableClasses movable(named);
    EXPECT_EQ(movable.named(), named);
    for (int id = -1; id < 80; ++id) {
      const bool is_living = id == 0 || (id >= 14 && id <= 23);
      EXPECT_EQ(movable.contains(id), is_living || std::count(named.begin(), named.end(), id) > 0)
          << id;
    }
  }
}

TEST(MovableMask, IsSetExactlyInsideInstancesThatCanMove) {
  Segmentation s;
  s.instances = {{0, 0.9F}, {56, 0.8F}, {16, 0.7F}, {39, 0.6F}};
  s.ids = GreyImage(5, 1);
  for (int u = 0; u < 5; ++u) s.ids.at(u, 0) = static_cast<std::uint8_t>(u);
  const auto mask = [&](const MovableClasses& movable) {
    const GreyImage image = movable_mask(s, movable);
    return std::vector<int>(image.begin(), image.end());
  };
  EXPECT_THAT(mask(MovableClasses()), ElementsAre(0, 255, 0, 255, 0));
  EXPECT_THAT(mask(MovableClasses({56})), ElementsAre(0, 255, 255, 255, 0));
}

}  // namespace
}  // namespace ygslam
