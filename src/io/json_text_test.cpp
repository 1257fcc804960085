#include "io/json_text.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

std::string nested(int depth) {
  return std::string(static_cast<std::size_t>(depth), '[') +
         std::string(static_cast<std::size_t>(depth), ']');
}

TEST(Json, NestingIsLimited) {
  EXPECT_TRUE(parse_json(nested(kMaxJsonDepth), "x").ok());
  EXPECT_FALSE(parse_json(nested(kMaxJsonDepth + 1), "x").ok());
  EXPECT_FALSE(parse_json(nested(200'000), "x").ok());
}

TEST(Json, BracketsInStringsAreNoNesting) {
  const auto json = parse_json("\"" + std::string(500, '[') + "\\\"[\"", "x");
  ASSERT_TRUE(json.ok());
  EXPECT_EQ(json->get<std::string>().size(), 502U);
}

TEST(Json, WhatIsNoJsonIsRefusedByName) {
  for (const char* text : {"", "{", "{\"a\": }", "nul", "[1,]", "{} x", "1e9999"}) {
    const auto json = parse_json(text, "instances.json");
    ASSERT_FALSE(json.ok()) << text;
    EXPECT_EQ(json.error().message.find("instances.json: "), 0U);
  }
}

}  // namespace
}  // namespace ygslam
