// The library as a program sees it: nothing but its header and its shared object. One test for each
// promise of the header; here those of Slam::open.
#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <cmath>
#include <limits>

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#endif

#include "facade/testing/film.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam::api {
namespace {

using testing::code_of;
using testing::film;
using testing::Record;
using testing::run;
using testing::settings_for;

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kNetworkLoads = false;  // the sanitizer refuses how its threads load a library
#else
constexpr bool kNetworkLoads = true;
#endif

TEST(Open, EveryFaultOfTheSettingsIsToldAtOnceWithCode3) {
  Settings settings = settings_for(film("static_xyz"));
  settings.options = {{"motion.tau_pz", "1"},
                      {"orb.levels", "99"},
                      {"segment.input_width", "100"},
                      {"segment.movable", "[unicorn]"}};
  settings.dynamic = "fast";
  settings.segmenter = "magic";
  std::string message;
  EXPECT_EQ(code_of([&] { Slam::open(settings); }, &message), 3);
  for (const char* part : {"motion.tau_pz", "'motion.tau_px'", "orb.levels", "segment.input_width",
                           "unicorn", "dynamic.mode = 'fast'", "segmenter magic"})
    EXPECT_NE(message.find(part), std::string::npos) << part << " not in: " << message;
}

TEST(Open, AnImpossibleCameraIsCode3AndNamesTheKey) {
  const auto refusal = [](auto change) {
    Settings settings;
    settings.segmenter = "none";
    settings.camera = {.fx = 517.3,
                       .fy = 516.5,
                       .cx = 318.6,
                       .cy = 255.3,
                       .k1 = 0.2624,
                       .k2 = -0.9531,
                       .p1 = -0.0054,
                       .p2 = 0.0026,
                       .k3 = 1.1633};
    change(settings.camera);
    std::string message;
    const int code = code_of([&] { Slam::open(settings); }, &message);
    EXPECT_EQ(code, message.empty() ? 0 : 3);
    return message;
  };
  EXPECT_EQ(refusal([](CameraModel&) {}), "");
  EXPECT_NE(refusal([](CameraModel& c) { c.k3 = 0; }).find("k1"), std::string::npos);
  EXPECT_EQ(refusal([](CameraModel& c) { c.ignore = {{0, 420, 640, 60}}; }), "");
  EXPECT_NE(refusal([](CameraModel& c) {
              c.ignore = {{0, 420, 640, 61}};
            }).find("ignore"),
            std::string::npos);
  EXPECT_NE(refusal([](CameraModel& c) { c.ignore_image = "no.png"; }).find("no.png"),
            std::string::npos);
  EXPECT_NE(refusal([](CameraModel& c) { c.k1 = -1; }).find("k1"), std::string::npos);
  EXPECT_EQ(refusal([](CameraModel& c) { c.cx = 0; }), "") << "odd, but it can be undone";
  EXPECT_NE(refusal([](CameraModel& c) { c.cx = -1; }).find("cx"), std::string::npos);
  EXPECT_NE(refusal([](CameraModel& c) { c.fx = 0; }).find("fx"), std::string::npos);
  EXPECT_NE(refusal([](CameraModel& c) { c.fy = NAN; }).find("fy"), std::string::npos);
  for (const int size : {0, -1, std::numeric_limits<int>::min(), std::numeric_limits<int>::max()}) {
    EXPECT_NE(refusal([&](CameraModel& c) { c.width = size; }).find("width"), std::string::npos);
    EXPECT_NE(refusal([&](CameraModel& c) { c.height = size; }).find("height"), std::string::npos);
  }
  EXPECT_EQ(refusal([](CameraModel& c) { c.device = "kinect_v1"; }), "");
  EXPECT_NE(refusal([](CameraModel& c) { c.device = "nikon"; }).find("kinect_v1"),
            std::string::npos);
  EXPECT_NE(refusal([](CameraModel& c) {
              c.device = "realsense_d455";
              c.colour_readout_ms = 20;
            }).find("colour_readout_ms"),
            std::string::npos);
}

TEST(Open, AModelThatIsNoneIsCode5WithoutAChildProcess) {
  static std::atomic<int> forks{0};
  pthread_atfork([] { ++forks; }, nullptr, nullptr);
#if defined(__SANITIZE_ADDRESS__)
  const __lsan::ScopedDisabler
      readers;  // OpenVINO unloads those of other formats with 8 bytes left
#endif
  const ygslam::testing::TempFolder folder;
  ygslam::testing::write(folder.path() / "garbage.onnx", "no network");
  Settings settings = settings_for(film("static_xyz"));
  settings.segmenter.clear();
  for (const char* name : {"garbage.onnx", "absent.onnx"}) {
    settings.model = (folder.path() / name).string();
    std::string message;
    EXPECT_EQ(code_of([&] { Slam::open(settings); }, &message), 5);
    EXPECT_NE(message.find(name), std::string::npos) << message;
  }
  settings.model.clear();
  settings.dynamic = "semantic";
  if (kNetworkLoads) {
    EXPECT_EQ(code_of([&] { Slam::open(settings); }), 0) << "with the built-in network";
  }
  settings.segmenter = "model";
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 5) << "that is not given";
  settings.segmenter = "none";
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 0);
  EXPECT_EQ(forks, 0);
}

TEST(Open, AnyKeyOfConfigIsTakenAndTheModeFollowsOptionsModelAndArgument) {
  Settings settings = settings_for(film("static_xyz"));
  settings.options["dynamic.mode"] = "off";
  const Record off = run(settings, film("static_xyz"));
  for (const Result& r : off.results) EXPECT_EQ(r.dynamic_points, 0);
  if (!kNetworkLoads) return;
  settings.dynamic = "semantic";  // says more than the option
  settings.segmenter.clear();
  const Record semantic = run(settings, film("static_xyz"));
  EXPECT_EQ(semantic.results.back().mask_age_frames, 0) << "of the built-in network";
}

}  // namespace
}  // namespace ygslam::api
