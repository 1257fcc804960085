#include "bag/bag_sequence.hpp"

#include <gtest/gtest.h>

#include "bag/mcap_writer.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

// They are large: refused as soon as one of their topics comes.
TEST(BagSequence, ARecordingOfTheRealSenseSdkIsNotReadThrough) {
  const testing::TempFolder folder;
  auto writer = McapWriter::create(folder.path() / "a.mcap");
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  constexpr int kImages = 50;
  for (int i = 1; i <= kImages; ++i) {
    ASSERT_TRUE(writer
                    ->write("/device_0/sensor_1/Color_0/image/data", ros::Image::kType, {i},
                            to_cdr(ros::Image()))
                    .ok());
    ASSERT_TRUE(writer->flush().ok());
  }
  ASSERT_TRUE(writer->finish().ok());
  int asked = 0;
  const auto opened = open_bag_sequence(folder.path() / "a.mcap", {}, {}, [&] {
    ++asked;
    return false;
  });
  ASSERT_FALSE(opened.ok());
  EXPECT_NE(opened.error().message.find("a recording of the RealSense SDK"), std::string::npos)
      << opened.error().message;
  EXPECT_LT(asked, kImages / 2) << "once a record at least";
}

}  // namespace
}  // namespace ygslam
