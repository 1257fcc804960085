#include "scene/class_colour.hpp"

#include <gtest/gtest.h>

#include <set>
#include <tuple>

namespace ygslam {
namespace {

TEST(ClassColour, TellsAllClassesApartAndIsNeverWhite) {
  std::set<std::tuple<int, int, int>> colours;
  for (const SemanticClass semantic_class : all_semantic_classes()) {
    const Rgb8 colour = class_colour(semantic_class);
    colours.insert({colour.r, colour.g, colour.b});
  }
  EXPECT_EQ(all_semantic_classes().size(), 84U);
  EXPECT_EQ(colours.size(), 84U);
  EXPECT_FALSE(colours.contains({255, 255, 255}));
}

}  // namespace
}  // namespace ygslam
