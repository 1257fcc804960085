#include "live/foxglove_protocol.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/rng.hpp"

namespace ygslam::foxglove {
namespace {

TEST(Foxglove, EitherNameOfTheProtocolIsTaken) {
  EXPECT_EQ(chosen_protocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(chosen_protocol("other, foxglove.sdk.v1, foxglove.websocket.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(chosen_protocol("foxglove.websocket.v2"), std::nullopt);
  EXPECT_EQ(chosen_protocol(""), std::nullopt);
}

TEST(Foxglove, EveryTopicIsAdvertisedWithItsSchema) {
  const auto json = nlohmann::json::parse(advertise(kRunTopics));
  ASSERT_EQ(json["channels"].size(), kRunTopics.size());
  EXPECT_EQ(json["channels"][0]["id"], 1);
  EXPECT_EQ(json["channels"][0]["topic"], "/tf");
  for (const auto& channel : json["channels"]) EXPECT_FALSE(channel["schema"].empty());
}

TEST(Foxglove, SubscriptionsAreUnderstood) {
  const auto request = parse_request(
      R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1},{"id":9,"channelId":3}]})", 3);
  ASSERT_TRUE(request.ok());
  EXPECT_EQ(request->added, (std::map<std::uint32_t, std::size_t>{{7, 0}, {9, 2}}));
  const auto ended = parse_request(R"({"op":"unsubscribe","subscriptionIds":[9,"x",-1]})", 3);
  ASSERT_TRUE(ended.ok());
  EXPECT_EQ(ended->removed, std::vector<std::uint32_t>{9});
}

TEST(Foxglove, WhatMakesNoSenseIsToldOrPassedOver) {
  for (const char* text :
       {"", "{", "[]", "7", R"({"op":7})",
        R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":4}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":0}]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":["x"]})"})
    EXPECT_FALSE(parse_request(text, 3).ok()) << text;
  for (const char* text : {R"({"op":"advertise"})", R"({"op":"subscribe"})",
                           R"({"op":"subscribe","subscriptions":{}})"}) {
    const auto request = parse_request(text, 3);
    ASSERT_TRUE(request.ok()) << text;
    EXPECT_TRUE(request->added.empty());
  }
  const std::string deep(32000, '[');
  EXPECT_FALSE(parse_request(deep, 3).ok());
  EXPECT_TRUE(
      parse_request(R"({"op":"x","subscriptions":)" + deep + std::string(32000, ']') + "}", 3)
          .ok());
  Rng rng(1);
  for (int i = 0; i < 10000; ++i) {  // whatever bytes come, they are answered
    std::string bytes(rng.below(64), '\0');
    for (char& c : bytes) c = static_cast<char>(rng.below(256));
    static_cast<void>(parse_request(bytes, 3));
    if (!bytes.empty()) bytes[0] = 2;
    const auto call = parse_call(bytes, 3);
    EXPECT_TRUE(!call.ok() || call->service < 3U);
  }
}

TEST(Foxglove, ACallIsAnsweredUnderItsNumbers) {
  const std::string bytes("\2\2\0\0\0\5\0\0\0\3\0\0\0cdr\0\1\0\0", 20);
  const auto call = parse_call(bytes, 2);
  ASSERT_TRUE(call.ok());
  EXPECT_EQ(call->service, 1U);
  EXPECT_EQ(call->id, 5U);
  EXPECT_FALSE(parse_call(bytes, 1).ok()) << "there is but one service";
  EXPECT_FALSE(parse_call(bytes.substr(0, 12), 2).ok());
  const std::string answer = call_response(*call, true, "ok");
  EXPECT_EQ(answer.substr(0, 13), std::string("\3\2\0\0\0\5\0\0\0\3\0\0\0", 13));
  EXPECT_EQ(answer.substr(13), std::string("cdr\0\1\0\0\1\0\0\0\3\0\0\0ok\0", 18));
}

}  // namespace
}  // namespace ygslam::foxglove
