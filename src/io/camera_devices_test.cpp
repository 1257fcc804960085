#include "io/camera_devices.hpp"

#include <gtest/gtest.h>

#include <set>

#include "io/calibration.hpp"

namespace ygslam {
namespace {

CameraConfig pinhole(double fx, double fy, double cx, double cy) {
  CameraConfig camera;
  camera.fx = fx, camera.fy = fy, camera.cx = cx, camera.cy = cy;
  return camera;
}

std::string_view recognised(std::string_view folder, const CameraConfig& camera) {
  const RecognisedDevice found = recognised_device(folder, camera);
  return found.device == nullptr ? "" : found.device->name;
}

TEST(CameraDevices, EachHasAName) {
  std::set<std::string_view> names;
  for (const CameraDevice& device : camera_devices()) {
    EXPECT_TRUE(names.insert(device.name).second) << device.name;
    EXPECT_EQ(find_camera_device(device.name), &device);
  }
  EXPECT_EQ(find_camera_device("nikon"), nullptr);
}

TEST(CameraDevices, RecordingsOfTumAndBonnAreRecognised) {
  for (const char* part : {"freiburg1", "freiburg2", "freiburg3", "rgbd_bonn"}) {
    const CameraConfig camera = camera_preset(part)->camera;
    const std::string folder = std::string("rgbd_dataset_") + part + "_walking_rpy";
    EXPECT_TRUE(recognised_device(folder, camera).is_certain) << part;
    EXPECT_EQ(recognised_device(folder, camera).by, "taken from the name of the folder");
  }
  const CameraConfig fr1 = camera_preset("freiburg1")->camera;
  EXPECT_EQ(recognised("renamed", fr1), "kinect_v1") << "its distortion is nobody else's";
  EXPECT_EQ(recognised_device("renamed", fr1).by, "recognised by its lens");
  EXPECT_EQ(recognised_device("renamed", fr1).depth_delay_ms, -16) << "its stamps";
  EXPECT_EQ(recognised_device("fr3", pinhole(525, 525, 319.5, 239.5)).depth_delay_ms, 0);
  EXPECT_EQ(recognised("tum_fr3_part", pinhole(535.4, 539.2, 320.1, 247.6)), "xtion");
  EXPECT_EQ(recognised("fr3", pinhole(525, 525, 319.5, 239.5)), "xtion") << "TUM's default";
}

TEST(CameraDevices, NumbersAloneAreAGuessOrNothing) {
  const CameraConfig delivered = pinhole(525, 525, 320, 240.75);
  EXPECT_EQ(recognised("kitchen", delivered), "kinect_v1");
  EXPECT_FALSE(recognised_device("kitchen", delivered).is_certain);
  EXPECT_EQ(recognised_device("kitchen", delivered).by, "by the 525 px");
  EXPECT_EQ(recognised("kitchen", pinhole(525.1, 525.1, 320, 240)), "");
  // The rendered worlds have freiburg3's numbers and a shutter of their own.
  EXPECT_EQ(recognised("walking_rpy", pinhole(535.4, 539.2, 320.1, 247.6)), "");
  EXPECT_EQ(recognised("fr31", pinhole(535.4, 539.2, 320.1, 247.6)), "") << "no such name";
  EXPECT_EQ(recognised("tum_fr3", pinhole(900, 900, 640, 360)), "") << "another camera";
}

TEST(CameraDevices, AFileMayNameOneAndNothingThatContradictsIt) {
  const auto parsed = [](const std::string& lines) {
    return parse_calibration("fx 500\nfy 500\ncx 320\ncy 240\n" + lines, "c");
  };
  const auto kinect = parsed("camera kinect_v1\n");
  ASSERT_TRUE(kinect.ok());
  EXPECT_GT(kinect->colour_readout_ms, 20);
  EXPECT_TRUE(kinect->shutter_known);
  const auto xtion = parsed("camera xtion\n");
  EXPECT_EQ(xtion->colour_readout_ms, kinect->colour_readout_ms);
  EXPECT_FALSE(xtion->shutter_known) << "nobody measured one: where an estimate starts";
  const auto own = parsed("camera kinect_v1\ncolour_readout_ms 30\n");
  ASSERT_TRUE(own.ok());
  EXPECT_EQ(own->colour_readout_ms, 30) << "what the file says counts";
  EXPECT_EQ(own->depth_readout_ms, kinect->depth_readout_ms) << "and the device's other times";
  EXPECT_EQ(own->depth_delay_ms, 0);
  const auto d455 = parsed("camera realsense_d455\n");
  ASSERT_TRUE(d455.ok());
  EXPECT_EQ(d455->colour_readout_ms, 0);
  EXPECT_TRUE(d455->shutter_known);
  EXPECT_FALSE(parsed("camera realsense_d435\n")->shutter_known) << "nobody published it";
  EXPECT_FALSE(parsed("camera realsense_d455\ncolour_readout_ms 20\n").ok());
  EXPECT_FALSE(parsed("camera nikon\n").ok());
}

}  // namespace
}  // namespace ygslam
