#include "io/trajectory_checks.hpp"

#include <gtest/gtest.h>

#include "io/testing/temp_folder.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {
namespace {

std::string fault_of(const std::string& text, std::optional<TrajectoryFormat> format = {}) {
  const auto file = parse_trajectory(text, "f", {.format = format});
  EXPECT_TRUE(file.ok() || file.error().kind == ErrorKind::kInput);
  return file.ok() ? "none" : file.error().message;
}

TEST(TrajectoryChecks, DecimalCommasAreTold) {
  for (const char* text :
       {"1305031102,5 1,5 2,5 3,5 0,0 0,0 0,0 1,0\n", "1305031102,5\t1,5\t2\t3,5\t0\t0\t0\t1\n",
        "1305031102,5;-1,5;2,5;3,5;0,0;0,0;0,0;1,0\n", "1,5,1,5,2,5,3,5,0,0,0,0,0,0,1,0\n",
        "1,0 0,0 0,0 0,5 0,0 1,0 0,0 -1,0 0,0 0,0 1,0 2,0\n",
        "1403636580838555648;4,68;-1,78;0,78;0,53;-0,15;-0,8;-0,08\n",
        "1,5e0 1,5e-3 2,5E+1 3 0 0 0 1\n"}) {
    EXPECT_EQ(fault_of(text), "f:1: decimal commas; numbers need a decimal point") << text;
  }
  for (const char* text : {"1.5,1,2,3,0,0,0,1\n", "1.5, 1, 2, 3, 0, 0, 0, 1\n", "1,1,2,3,0,0,0,1\n",
                           "1,1,2, 3,0,0,0,1\n", "1.5 1 2 3 0 0 0 1\n", "1.5;1;2;3;0;0;0;1\n"}) {
    EXPECT_EQ(fault_of(text), "none") << text;
  }
}

TEST(TrajectoryChecks, LinesThatEndInCarriageReturnsAloneAreTold) {
  const std::string wanted = "a carriage return within the line; lines must end in LF or CR LF";
  for (const char* text :
       {"1 0 0 0 0 0 0 1\r2 0 0 0 0 0 0 1\r", "# stamp x\r1 0 0 0 0 0 0 1\r2 0 0 0 0 0 0 1",
        "1 0 0 0 0 1 0 0 0 0 1 0\r1 0 0 1 0 1 0 0 0 0 1 0\r"}) {
    EXPECT_EQ(fault_of(text), "f:1: " + wanted) << text;
  }
  EXPECT_EQ(fault_of("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\r3 0 0 0 0 0 0 1\n"), "f:2: " + wanted);
  for (const char* text : {"1 0 0 0 0 0 0 1\r\n2 0 0 0 0 0 0 1\r\n", "1 0 0 0 0 0 0 1\r",
                           "# a\rb\n1 0 0 0 0 0 0 1\r\r\n"}) {
    EXPECT_EQ(fault_of(text), "none") << text;
  }
}

TEST(TrajectoryChecks, KittiIsNotTakenForTum) {
  const std::string whole = "0.6 -0.8 0 5 0.8 0.6 0 -1 0 0 1 2\n";
  EXPECT_EQ(fault_of(whole), "none");
  EXPECT_NE(fault_of(whole, TrajectoryFormat::kTum).find("f:1: a KITTI pose"), std::string::npos);
  for (const char* cut :
       {"0.6 -0.8 0 5 0.8 0.6 0 -1 0 0 1\n", "-0.8 0 5 0.8 0.6 0 -1 0 0 1 2\n",
        "0.6 -0.8 0 0.8 0.6 0 -1 0 0 1 2\n", "0.6 -0.8 0 5 0.8 0.6 -1 0 0 1 2\n"}) {
    EXPECT_EQ(fault_of(cut), "f:1: 11 columns, a KITTI pose of 12 with one missing") << cut;
    EXPECT_NE(fault_of(cut, TrajectoryFormat::kTum), "none") << cut;
  }
  for (const char* tum : {"1 0 0 0 0 0 0 1 0 0 0\n", "1305031102.5 1 0 0 0 0 0 1 0 1 0\n",
                          "1305031102.5 1 0 0 0 0 0 1 7 7 7 7\n"}) {
    EXPECT_EQ(fault_of(tum, TrajectoryFormat::kTum), "none") << "further columns are allowed";
  }
}

TEST(TrajectoryChecks, StampsOfAnotherUnitAreTold) {
  EXPECT_NE(fault_of("1,0,0,0,1,0,0,0\n2,0,0,0,1,0,0,0\n", TrajectoryFormat::kEuroc)
                .find("less than a microsecond apart"),
            std::string::npos);
  EXPECT_NE(fault_of("0,0,0,0,1,0,0,0\n5000000,0,0,0,1,0,0,0\n").find("more than a day apart"),
            std::string::npos);
  EXPECT_EQ(fault_of("0,0,0,0,1,0,0,0\n5000000,0,0,0,1,0,0,0\n", TrajectoryFormat::kEuroc), "none");
}

TEST(TrajectoryChecks, TimesHaveDecimalPointsAndLines) {
  const testing::TempFolder folder;
  const auto times = folder.path() / "times.txt";
  for (const char* text : {"0,0\n0,1\n", "0.0\r0.1\r"}) {
    auto file = parse_trajectory("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n", "poses");
    testing::write(times, text);
    const Status added = add_stamps(times, "poses", *file);
    ASSERT_FALSE(added.ok()) << text;
    EXPECT_EQ(added.error().message.find(times.string() + ":1: a "), 0U) << added.error().message;
  }
}

}  // namespace
}  // namespace ygslam
