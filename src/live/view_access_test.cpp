#include "live/view_access.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

TEST(ViewAccess, TokensDifferAndAreComparedWhole) {
  const std::string token = new_token();
  EXPECT_EQ(token.size(), 32U);
  EXPECT_NE(token, new_token());
  EXPECT_TRUE(is_same_token(token, token));
  EXPECT_FALSE(is_same_token(token, token.substr(0, 31)));
  EXPECT_FALSE(is_same_token(token, ""));
  EXPECT_FALSE(is_same_token("abc", "abd"));
}

TEST(ViewAccess, ATargetsQueryIsRead) {
  EXPECT_EQ(query_value("/ws?token=abc", "token"), "abc");
  EXPECT_EQ(query_value("/ws?a=b&token=abc&c", "token"), "abc");
  for (const char* target : {"", "/ws", "/ws?", "/ws?token", "/ws?token=", "/ws?tokens=abc", "?&&"})
    EXPECT_EQ(query_value(target, "token"), "") << target;
}

TEST(ViewAccess, OtherNamesThanTheMachinesOwnAreTold) {
  for (const char* host :
       {"127.0.0.1", "127.0.0.1:8765", "localhost:9000", "[::1]:80", "[::1]", "127.0.0.2:8765"})
    EXPECT_TRUE(names_this_machine(host, "127.0.0.2")) << host;
  for (const char* host : {"", ":", "[", "evil.example", "evil.example:8765", "localhost.evil:80",
                           "127.0.0.1.evil.example", "[::2]:80"})
    EXPECT_FALSE(names_this_machine(host, "127.0.0.2")) << host;
}

}  // namespace
}  // namespace ygslam
