#include <gtest/gtest.h>

#include "live/view_server.hpp"

namespace ygslam {
namespace {

TEST(ViewAddress, PortAndAddressMayBeGiven) {
  EXPECT_EQ(parse_view_address("")->port, 8765);
  EXPECT_EQ(parse_view_address("80")->host, "127.0.0.1");
  EXPECT_EQ(parse_view_address("0.0.0.0:81")->host, "0.0.0.0");
  EXPECT_EQ(parse_view_address("[::1]:82")->host, "::1");
  EXPECT_EQ(parse_view_address("[::1]:82")->port, 82);
  for (const char* text : {"x", "70000", "-1", "robot:80", "1.2.3:80", "127.0.0.1:", "80x"})
    EXPECT_FALSE(parse_view_address(text).ok()) << text;
}

}  // namespace
}  // namespace ygslam
