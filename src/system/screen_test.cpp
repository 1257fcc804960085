// A screen that plays a video, before a camera that moves or stands: the camera's motion is that of
// the room.
#include <gtest/gtest.h>

#include <string>

#include "system/testing/rendered_recording.hpp"

namespace ygslam::system_test {
namespace {

constexpr int kVideo = 9;
constexpr int kScrolling = 209;
constexpr int kStill = 8;

/// A monitor of 1.2 x 0.7 m that covers a third of the image.
Recording screen_recording(const std::string& path, int variant) {
  sim::SequenceOptions options = small(3);
  options.fps = 15;
  const auto world = sim::parse_world(
      "layout: office\n"
      "camera: {path: " +
          path +
          ", at: [0, -1.9, 1.4], look_at: [0, 1.5, 0.9]}\n"
          "furniture: [{kind: monitor, variant: " +
          std::to_string(variant) + ", at: [0, -0.4, 0.4], size: [1.2, 0.05, 0.7]}]\n",
      "test");
  CHECK(world.ok(), world.error().message.c_str());
  return record(*world, options);
}

/// Frames that lie farther than this from the truth.
int frames_off(const std::string& path, int variant, double limit_m) {
  const Recording recording = screen_recording(path, variant);
  const Trial run = run_offline(small_config(DynamicMode::kFull), recording);
  int off = 0;
  for (std::size_t i = 0; i < run.results.size(); ++i)
    off += run.has_pose(i) && drift_m(recording, run, i) < limit_m ? 0 : 1;
  return off;
}

// The picture's first step, of 26 mm, may be believed for a frame before it is found out.
TEST(Screen, AVideoThatPansMovesNoCamera) {
  EXPECT_LE(frames_off("xyz", kVideo, 0.015), 1);
  EXPECT_LE(frames_off("static", kVideo, 0.015), 1);
}

TEST(Screen, ATextThatScrollsMovesNoCamera) { EXPECT_LE(frames_off("xyz", kScrolling, 0.015), 1); }

TEST(Screen, AStillPictureIsAsGoodAsAnyWall) { EXPECT_EQ(frames_off("xyz", kStill, 0.005), 0); }

}  // namespace
}  // namespace ygslam::system_test
