#include "scene/semantic_class.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

TEST(SemanticClass, HasTheNamesOfCocoAndOfRooms) {
  EXPECT_EQ(semantic_class_name(coco_class(0)), "person");
  EXPECT_EQ(semantic_class_name(coco_class(56)), "chair");
  EXPECT_EQ(semantic_class_name(SemanticClass::kFloor), "floor");
  EXPECT_EQ(semantic_class_name(SemanticClass::kUnknown), "unknown");
}

}  // namespace
}  // namespace ygslam
