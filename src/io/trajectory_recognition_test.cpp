// One file of each format, and of each that is refused.
#include "io/trajectory_recognition.hpp"

#include <gtest/gtest.h>

#include "core/log.hpp"
#include "core/rng.hpp"
#include "io/testing/temp_folder.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {
namespace {

constexpr std::int64_t kStart_ns = 1'305'031'102'175'304'000, kStep_ns = 33'333'000;

std::vector<StampedPose> sample_poses(std::size_t count = 12) {
  Rng rng(11);
  std::vector<StampedPose> poses;
  for (std::size_t i = 0; i < count; ++i) {
    Vec6 twist;
    for (int k = 0; k < 6; ++k) twist[k] = rng.uniform(-1.5, 1.5);
    poses.push_back({{kStart_ns + static_cast<std::int64_t>(i) * kStep_ns}, SE3::exp(twist)});
  }
  return poses;
}

std::string numbers_text(std::initializer_list<double> values, const char* separator = " ") {
  std::string text;
  for (const double value : values)
    text += (text.empty() ? "" : separator) + fmt::format("{:.9f}", value);
  return text;
}

std::string position_text(const SE3& T, const char* separator = " ") {
  return numbers_text({T.t().x(), T.t().y(), T.t().z()}, separator);
}
std::string xyzw_text(const SE3& T, const char* separator = " ") {
  const Eigen::Quaterniond q = T.quaternion();
  return numbers_text({q.x(), q.y(), q.z(), q.w()}, separator);
}
std::string wxyz_text(const SE3& T, const char* separator = " ") {
  const Eigen::Quaterniond q = T.quaternion();
  return numbers_text({q.w(), q.x(), q.y(), q.z()}, separator);
}
// The first rows of the pose's matrix.
std::string rows_text(const SE3& T, const char* between = " ") {
  std::string text;
  for (int r = 0; r < 3; ++r) {
    text +=
        (r == 0 ? "" : between) + numbers_text({T.R()(r, 0), T.R()(r, 1), T.R()(r, 2), T.t()[r]});
  }
  return text;
}
std::string seconds_text(const StampedPose& pose) {
  return fmt::format("{}.{:09}", pose.stamp.ns / 1'000'000'000, pose.stamp.ns % 1'000'000'000);
}

struct Format {
  const char* name;
  const char* taken_for;
  bool has_stamps;
  const char* head;
  std::string (*line)(const StampedPose&, std::size_t);
};

const std::vector<Format>& formats() {
  using P = const StampedPose&;
  static const std::vector<Format> all = {
      {"TUM", "", true, "# timestamp tx ty tz qx qy qz qw\n",
       [](P p, std::size_t) {
         return seconds_text(p) + " " + position_text(p.T_world_camera) + " " +
                xyzw_text(p.T_world_camera);
       }},
      {"ORB-SLAM3, nanoseconds", "TUM, stamps in nanoseconds", true, "",
       [](P p, std::size_t) {
         return fmt::format("{}.000000 ", p.stamp.ns) + position_text(p.T_world_camera) + " " +
                xyzw_text(p.T_world_camera);
       }},
      {"milliseconds", "TUM, stamps in milliseconds", true, "",
       [](P p, std::size_t) {
         return fmt::format("{}.{:06} ", p.stamp.ns / 1'000'000, p.stamp.ns % 1'000'000) +
                position_text(p.T_world_camera) + " " + xyzw_text(p.T_world_camera);
       }},
      {"w first by a comment", "columns as the header names them, quaternion x y z w in 6, 7, 8, 5",
       true, "# timestamp tx ty tz qw qx qy qz\n",
       [](P p, std::size_t) {
         return seconds_text(p) + " " + position_text(p.T_world_camera) + " " +
                wxyz_text(p.T_world_camera);
       }},
      {"pandas", "columns as the header names them, quaternion x y z w in 6, 7, 8, 9", true,
       ",timestamp,x,y,z,qx,qy,qz,qw\n",
       [](P p, std::size_t i) {
         return fmt::format("{},{},", i, seconds_text(p)) + position_text(p.T_world_camera, ",") +
                "," + xyzw_text(p.T_world_camera, ",");
       }},
      {"rostopic",
       "columns as the header names them, quaternion x y z w in 8, 9, 10, 11, stamps in "
       "nanoseconds",
       true,
       "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.position.x,"
       "field.pose.position.y,field.pose.position.z,field.pose.orientation.x,"
       "field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w\n",
       [](P p, std::size_t i) {
         return fmt::format("{},{},{},,", p.stamp.ns + 5'000'000, i, p.stamp.ns) +
                position_text(p.T_world_camera, ",") + "," + xyzw_text(p.T_world_camera, ",");
       }},
      {"ros2 topic echo --csv", "seconds, nanoseconds, x y z qx qy qz qw", true, "",
       [](P p, std::size_t) {
         return fmt::format("{},{},map,", p.stamp.ns / 1'000'000'000, p.stamp.ns % 1'000'000'000) +
                position_text(p.T_world_camera, ",") + "," + xyzw_text(p.T_world_camera, ",");
       }},
      {"seconds and nanoseconds", "seconds, nanoseconds, x y z qx qy qz qw", true, "",
       [](P p, std::size_t) {
         return fmt::format("{},{},", p.stamp.ns / 1'000'000'000, p.stamp.ns % 1'000'000'000) +
                position_text(p.T_world_camera, ",") + "," + xyzw_text(p.T_world_camera, ",");
       }},
      {"number and stamp", "number, stamp, x y z qx qy qz qw", true, "",
       [](P p, std::size_t i) {
         return fmt::format("{} {} ", i, seconds_text(p)) + position_text(p.T_world_camera) + " " +
                xyzw_text(p.T_world_camera);
       }},
      {"no stamps", "x y z qx qy qz qw, no stamps", false, "",
       [](P p, std::size_t) {
         return position_text(p.T_world_camera) + " " + xyzw_text(p.T_world_camera);
       }},
      {"KITTI", "KITTI (3x4 matrices, no stamps)", false, "",
       [](P p, std::size_t) { return rows_text(p.T_world_camera); }},
      {"Replica", "4x4 matrices, no stamps", false, "",
       [](P p, std::size_t) { return rows_text(p.T_world_camera) + " 0 0 0 1"; }},
      {"4x4 by columns", "4x4 matrices column by column, no stamps", false, "",
       [](P p, std::size_t) {
         const Mat3& R = p.T_world_camera.R();
         return numbers_text({R(0, 0), R(1, 0), R(2, 0), 0, R(0, 1), R(1, 1), R(2, 1), 0, R(0, 2),
                              R(1, 2), R(2, 2), 0}) +
                " " + position_text(p.T_world_camera) + " 1";
       }},
      {"4x4 in four lines", "4x4 matrices in four lines each, no stamps", false, "",
       [](P p, std::size_t) { return rows_text(p.T_world_camera, "\n") + "\n0 0 0 1\n"; }},
      {"Open3D", "4x4 matrices with a line of numbers before each (Open3D), no stamps", false, "",
       [](P p, std::size_t i) {
         return fmt::format("{} {} {}\n", i, i, i + 1) + rows_text(p.T_world_camera, "\n") +
                "\n0 0 0 1";
       }},
      {"3x4 in three lines", "3x4 matrices in three lines each, no stamps", false, "",
       [](P p, std::size_t) { return rows_text(p.T_world_camera, "\n") + "\n"; }},
      {"stamp and 3x4", "stamp and 3x4 matrix", true, "",
       [](P p, std::size_t) { return seconds_text(p) + " " + rows_text(p.T_world_camera); }},
      {"stamp and 4x4", "stamp and 4x4 matrix", true, "",
       [](P p, std::size_t) {
         return seconds_text(p) + " " + rows_text(p.T_world_camera) + " 0 0 0 1";
       }},
      {"COLMAP", "COLMAP images.txt (poses of the world in the camera: turned round)", true,
       "# Image list with two lines of data per image:\n"
       "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
       "#   POINTS2D[] as (X, Y, POINT3D_ID)\n",
       [](P p, std::size_t i) {
         const SE3 T = p.T_world_camera.inverse();
         return fmt::format("{} ", i + 1) + wxyz_text(T) + " " + position_text(T) + " 1 rgb/" +
                seconds_text(p) + ".png\n" + (i % 2 == 0 ? "10.5 20.5 -1 30.5 40.5 7\n" : "");
       }},
      {"COLMAP, numbered images",
       "COLMAP images.txt (poses of the world in the camera: turned round), no stamps, in the "
       "order "
       "of the images' names",
       false, "",
       [](P p, std::size_t i) {
         const SE3 T = p.T_world_camera.inverse();
         return fmt::format("{} ", 40 - i) + wxyz_text(T) + " " + position_text(T) +
                fmt::format(" 1 frame{}.jpg\n\n", i);
       }},
  };
  return all;
}

TEST(TrajectoryEvidence, EveryFormatGivesTheSamePosesAndSaysWhatItIs) {
  const testing::TempFolder folder;
  const auto poses = sample_poses();
  for (const Format& format : formats()) {
    std::string text = format.head;
    for (std::size_t i = 0; i < poses.size(); ++i) text += format.line(poses[i], i) + "\n";
    const auto path = folder.path() / "trajectory";
    testing::write(path, text);
    const auto file = read_trajectory(path);
    ASSERT_TRUE(file.ok()) << format.name << ": " << file.error().message;
    EXPECT_EQ(file->taken_for, format.taken_for) << format.name;
    EXPECT_EQ(file->has_stamps, format.has_stamps) << format.name;
    ASSERT_EQ(file->poses.size(), poses.size()) << format.name;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const std::int64_t ns = format.has_stamps ? poses[i].stamp.ns : static_cast<std::int64_t>(i);
      EXPECT_EQ(file->poses[i].stamp.ns, ns) << format.name;
      const SE3 error = file->poses[i].T_world_camera.inverse() * poses[i].T_world_camera;
      EXPECT_LT(error.t().norm() + error.angle(), 1e-7) << format.name;
    }
    EXPECT_EQ(read_stamped_trajectory(path).ok(), format.has_stamps) << format.name;
  }
}

struct Refusal {
  const char* name;
  const char* text;
  const char* part;
};

TEST(TrajectoryEvidence, WhatCannotBeToldApartIsRefused) {
  for (const Refusal& refusal : std::vector<Refusal>{
           {"quaternion before position", "1.5 0.5 0.5 0.5 0.5 3 2 1\n2.5 0.5 0.5 0.5 0.5 3 2 2\n",
            "f:1: 8 columns, of which 2 to 5 have unit length"},
           {"no unit quaternion", "1.5 1 2 3 4 5 6 7\n2.5 1 2 3 4 5 6 7\n",
            "f:1: 8 columns, of which 5 to 8 are no unit quaternion (length 11.2)"},
           {"one quaternion too short", "1.5 1 2 3 0 0 0 1\n2.5 1 2 3 0 0 0 0.5\n",
            "f:2: quaternion of length 0.5, not 1"},
           {"a header that contradicts the numbers",
            "# t x y z qw qx qy qz\n1.5 3 3 3 9 0 0 1\n2.5 3 3 3 9 0 0 1\n",
            "f:2: columns 6, 7, 8, 5, which the header names qx qy qz qw, are no unit quaternion"},
           {"angles", "t,x,y,z,roll,pitch,yaw\n1,1,2,3,0,0,0\n", "f:1: the header names angles"},
           {"another table", "name,price\n1,2\n", "f:1: 'name,price' names no columns"},
           {"two poses a line",
            "t,a.x,a.y,a.z,x,y,z,x,y,z,qx,qy,qz,qw\n1,1.5,2,3,1,2,3,1,2,3,0,0,0,1\n",
            "f:1: the header names two columns like 'z'"},
           {"header of another length", "t,x,y,z,qx,qy,qz,qw\n1,1,2,3,0,0,0,1,5\n",
            "f:2: 9 columns, the header names 8"},
           {"number or second", "0 500000000 1 2 1 0 0 0 1\n1 600000000 1 2 1 0 0 0 1\n",
            "can be read in"},
           {"positions only", "1.5 1 2 3 4\n2.5 1 2 3 5\n", "f:1: 5 columns"},
           {"mirrored matrices", "-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n",
            "f:1: the matrix is no rotation but a reflection"},
           {"matrices of either order", "0 -1 0 0 1 0 0 0 0 0 1 0 0 0 0 1\n", "can be read in"},
           {"a matrix cut short", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 0 0 0\n0 1 0 0\n",
            "f:5: a matrix of which line 3 of 4 has not 4 numbers"},
           {"lines of four", "1 2 3 4\n2 3 4 5\n3 4 5 6\n", "f:1: lines of 4 numbers that are no"},
           {"a number that is none", "1 0 0 nan 0 0 0 1\n", "f:1: 'nan' is no finite number"},
           {"UTF-16",
            "\xFF\xFE"
            "1",
            "f: is UTF-16 text"},
           {"a NumPy array", "\x93NUMPY\x01", "f: is a NumPy array"},
           {"JSON", "{\"poses\": [1, 2]}\n", "f:1: JSON, or numbers in brackets; read are"},
           {"JSON over lines", "[\n [1.5, 1, 2, 3, 0, 0, 0, 1],\n [2, 1, 2, 3, 0, 0, 0, 1]\n]\n",
            "f:1: JSON"},
           {"printed lists", "# poses\n1.5 [1 2 3] [0 0 0 1]\n2.5 [1 2 3] [0 0 0 1]\n",
            "f:2: JSON"},
           {"printed tuples", "1.5,(1,2,3),(0,0,0,1)\n2.5,(1,2,3),(0,0,0,1)\n", "f:1: JSON"},
           {"a comment alone", "# nothing\n", "f: no pose in the file"}}) {
    const auto file = parse_trajectory(refusal.text, "f");
    ASSERT_FALSE(file.ok()) << refusal.name << " was read as " << file->taken_for;
    EXPECT_EQ(file.error().kind, ErrorKind::kInput);
    EXPECT_NE(file.error().message.find(refusal.part), std::string::npos)
        << refusal.name << ": " << file.error().message;
    EXPECT_EQ(file.error().message.find('\n'), std::string::npos) << refusal.name;
  }
}

TEST(TrajectoryEvidence, TwoOrdersOfQuaternionsInOneFileAreTold) {
  const auto warnings_of = [](bool changes) {
    std::string text;
    std::string heard;
    for (int i = 0; i < 60; ++i) {
      const Eigen::Quaterniond q(
          Eigen::AngleAxisd(0.5 + 0.01 * i, Vec3(1, 2, 0.5 + 0.01 * i).normalized()));
      const bool w_first = changes && i >= 30;
      text += w_first
                  ? fmt::format("{} 1 2 3 {} {} {} {}\n", 5 + 0.1 * i, q.w(), q.x(), q.y(), q.z())
                  : fmt::format("{} 1 2 3 {} {} {} {}\n", 5 + 0.1 * i, q.x(), q.y(), q.z(), q.w());
    }
    const log::ScopedSink sink(std::make_shared<const log::Sink>(
        [&](log::Level, const std::string& line) { heard += line + "\n"; }));
    EXPECT_TRUE(parse_trajectory(text, "f").ok());
    return heard;
  };
  EXPECT_EQ(warnings_of(false), "");
  const std::string told = warnings_of(true);
  EXPECT_NE(told.find("f:31: the pose turns by"), std::string::npos) << told;
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1);
}

/// Small motions: whatever stands beside a 1 is nearly of unit length.
TEST(TrajectoryEvidence, OtherColumnsBesideSmallTranslationsAreNoQuaternions) {
  Rng rng(5);
  const auto number = [&](double size) { return rng.uniform(-size, size); };
  std::string quaternion_first, number_stamp_matrix, by_columns, stamp_last, tum;
  for (int i = 0; i < 40; ++i) {
    const SE3 T = SE3::exp((Vec6() << number(0.04), number(0.04), number(0.04), number(0.03),
                            number(0.03), number(0.03))
                               .finished());
    const std::string stamp = fmt::format("{:.6f} ", 1305031102.2 + 0.1 * i);
    tum += stamp + position_text(T) + " " + xyzw_text(T) + "\n";
    quaternion_first += stamp + xyzw_text(T) + " " + position_text(T) + "\n";
    number_stamp_matrix += fmt::format("{} ", i) + stamp + rows_text(T) + " 0 0 0 1\n";
    const Mat3& R = T.R();
    by_columns += stamp +
                  numbers_text({R(0, 0), R(1, 0), R(2, 0), R(0, 1), R(1, 1), R(2, 1), R(0, 2),
                                R(1, 2), R(2, 2)}) +
                  " " + position_text(T) + "\n";
    stamp_last += rows_text(T) + " " + stamp + "\n";
  }
  EXPECT_TRUE(parse_trajectory(tum, "f").ok());
  for (const auto& [text, words] :
       {std::pair{quaternion_first,
                  "of which 2 to 5 have unit length as a quaternion has, more "
                  "exactly than 5 to 8"},
        std::pair{number_stamp_matrix, "of which 3 to 13 have a rotation matrix in them"},
        std::pair{by_columns, "of which 2 to 10 have a rotation matrix in them"},
        std::pair{stamp_last, "of which 1 to 11 have a rotation matrix in them"}}) {
    const auto file = parse_trajectory(text, "f");
    ASSERT_FALSE(file.ok()) << text.substr(0, 200);
    EXPECT_NE(file.error().message.find(words), std::string::npos) << file.error().message;
  }
}

TEST(TrajectoryEvidence, MatricesBehindNamesOfImagesAreMatrices) {
  std::string text;
  for (int i = 0; i < 10; ++i)
    text += fmt::format("frame{}.jpg 1 0 0 0.{} 0 1 0 0 0 0 1 0 0 0 0 1\n", i, i);
  const auto file = parse_trajectory(text, "f");
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->taken_for, "4x4 matrices, no stamps");
}

TEST(TrajectoryEvidence, MicrosecondsAreNoNanoseconds) {
  std::string text;
  for (int i = 0; i < 40; ++i)
    text += fmt::format("{} {} 1 2 3 0 0 0 1\n", 1305031102 + i / 10, 100'000 * (i % 10));
  EXPECT_FALSE(parse_trajectory(text, "f").ok());
}

TEST(TrajectoryEvidence, ListsOfImagesAreNoMatrices) {
  const auto file = parse_trajectory("1.0 rgb/1.png 1.0 depth/1.png\n", "f");
  ASSERT_FALSE(file.ok());
  EXPECT_EQ(file.error().message.find("matrix of which"), std::string::npos);
}

std::string warnings_of(const std::string& text) {
  std::string heard;
  const log::ScopedSink sink(std::make_shared<const log::Sink>(
      [&](log::Level, const std::string& line) { heard += line + "\n"; }));
  EXPECT_TRUE(parse_trajectory(text, "f").ok());
  return heard;
}

TEST(TrajectoryOrder, LinesThatGoBackAreTold) {
  constexpr const char* kPose = " 1 2 3 0 0 0 1\n";
  std::string rising, unpadded;
  for (int i = 0; i < 30; ++i) {
    rising += fmt::format("5.{:02}{}", 3 * i, kPose);
    unpadded += fmt::format("5.{}{}", 3 * i, kPose);
  }
  EXPECT_EQ(warnings_of(rising), "");
  EXPECT_NE(warnings_of(std::string("9.00") + kPose + rising).find("go back in 1 of 31 lines"),
            std::string::npos);
  EXPECT_NE(warnings_of(unpadded).find("without their leading zeros?"), std::string::npos);
}

TEST(TrajectoryOrder, FramesWithoutAPoseAreTold) {
  std::string text = "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n3 0.1 0 0 0 0 0 1\n4 0.2 0 0 0 0 0 1\n";
  EXPECT_EQ(warnings_of(text), "");
  text += "5 0 0 0 0 0 0 1\n6 0 0 0 0 0 0 1\n7 0.3 0 0 0 0 0 1\n";
  EXPECT_NE(warnings_of(text).find("2 poses leap to 0 0 0 0 0 0 1"), std::string::npos);
}

TEST(TrajectoryEvidence, StampsOfNoEpochNeedTheirUnitSaid) {
  const std::string text = "0 1 2 3 0 0 0 1\n33333333 1 2 3 0 0 0 1\n66666666 1 2 3 0 0 0 1\n";
  const auto refused = parse_trajectory(text, "f");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("--stamps ns"), std::string::npos);
  const auto file = parse_trajectory(text, "f", {.unit = StampUnit::kNanoseconds});
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->poses[2].stamp.ns, 66'666'666);
}

TEST(TrajectoryEvidence, StampsKeepEveryDigitInEveryUnit) {
  for (const auto& [word, unit, ns] :
       {std::tuple{"1403636580838555648.000000", StampUnit::kNanoseconds, 1403636580838555648},
        std::tuple{"1.403636580838555648e18", StampUnit::kNanoseconds, 1403636580838555648},
        std::tuple{"1403636580838555.648", StampUnit::kMicroseconds, 1403636580838555648},
        std::tuple{"1403636580838.555648", StampUnit::kMilliseconds, 1403636580838555648},
        std::tuple{"1403636580.838555648", StampUnit::kSeconds, 1403636580838555648}}) {
    const auto stamp = parse_stamp(word, unit);
    ASSERT_TRUE(stamp.has_value()) << word;
    EXPECT_EQ(stamp->ns, ns) << word;
  }
  EXPECT_FALSE(parse_stamp("1.5", StampUnit::kNanoseconds).has_value());
}

}  // namespace
}  // namespace ygslam
