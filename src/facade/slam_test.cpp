// The library as a program sees it: nothing but its header and its shared object. One test for each
// promise of the header.
#include "ygslam/slam.hpp"

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <mutex>
#include <thread>

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#endif

#include "core/testing/memory_limit.hpp"
#include "core/testing/recorded_data.hpp"
#include "io/testing/temp_folder.hpp"
#include "simulation/sequence/sequence_source.hpp"

namespace ygslam::api {
namespace {

constexpr int kWidth = 320, kHeight = 240;

/// Rendered frames, kept for all tests.
struct Film {
  CameraModel camera;
  std::vector<std::shared_ptr<const sim::SimulatedFrame>> frames;

  [[nodiscard]] Frame operator[](std::size_t i) const {
    const RgbdFrame& f = *frames[i]->frame;
    return {f.stamp.ns, reinterpret_cast<const std::uint8_t*>(f.colour.data()), f.depth_m.data()};
  }
  [[nodiscard]] std::size_t size() const { return frames.size(); }
};

const Film& film(const std::string& world) {
  static std::map<std::string, Film> films;
  Film& film = films[world];
  if (!film.frames.empty()) return film;
  sim::SequenceOptions options;
  options.seconds = world == "moving_box" ? 6 : 1.5;  // a mover is one after half a second
  options.fps = 20;
  options.width = kWidth;
  options.height = kHeight;
  options.texture_size = 256;
  options.antialias = false;
  if (world == "walking_rpy") options.rolling = 0.8;
  auto source = sim::open_world(world, options);
  CHECK(source.ok(), "the world is known");
  const CameraConfig c = source->camera().config();
  film.camera = {
      .fx = c.fx, .fy = c.fy, .cx = c.cx, .cy = c.cy, .width = kWidth, .height = kHeight};
  while (auto frame = source->next())
    film.frames.push_back(std::make_shared<const sim::SimulatedFrame>(std::move(*frame)));
  return film;
}

Settings settings_for(const Film& film) {
  Settings settings;
  settings.camera = film.camera;
  settings.options = {{"orb.features", "500"}};
  return settings;
}

/// The code of the Error that the call throws, 0 without one; its text goes to `message`.
template <typename Call>
int code_of(Call call, std::string* message = nullptr) {
  try {
    call();
    return 0;
  } catch (const Error& e) {
    if (message) *message = e.what();
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    return e.code;
  }
}

/// Everything an object says about a film.
struct Record {
  std::vector<Result> results;
  Outcome outcome;
};

Record run(const Settings& settings, const Film& film) {
  Slam slam = Slam::open(settings);
  Record record;
  for (std::size_t i = 0; i < film.size(); ++i) record.results.push_back(slam.process(film[i]));
  record.outcome = slam.finish();
  return record;
}

bool same(const Pose& a, const Pose& b) {
  return a.translation_m == b.translation_m && a.rotation_xyzw == b.rotation_xyzw;
}

void expect_same(const Outcome& a, const Outcome& b) {
  ASSERT_EQ(a.trajectory.size(), b.trajectory.size());
  for (std::size_t i = 0; i < a.trajectory.size(); ++i) {
    EXPECT_EQ(a.trajectory[i].t_ns, b.trajectory[i].t_ns);
    EXPECT_TRUE(same(a.trajectory[i].T_world_camera, b.trajectory[i].T_world_camera)) << i;
  }
  ASSERT_EQ(a.static_map.size(), b.static_map.size());
  for (std::size_t i = 0; i < a.static_map.size(); ++i) {
    const MapPoint &p = a.static_map[i], &q = b.static_map[i];
    ASSERT_TRUE(p.x_m == q.x_m && p.y_m == q.y_m && p.z_m == q.z_m && p.r == q.r && p.g == q.g &&
                p.b == q.b);
  }
}

TEST(Open, EveryFaultOfTheSettingsIsToldAtOnceWithCode3) {
  Settings settings = settings_for(film("static_xyz"));
  settings.options = {{"motion.tau_pz", "1"},
                      {"orb.levels", "99"},
                      {"segment.input_width", "100"},
                      {"segment.movable", "[unicorn]"}};
  settings.dynamic = "fast";
  std::string message;
  EXPECT_EQ(code_of([&] { Slam::open(settings); }, &message), 3);
  for (const char* part : {"motion.tau_pz", "'motion.tau_px'", "orb.levels", "segment.input_width",
                           "unicorn", "dynamic.mode = 'fast'"})
    EXPECT_NE(message.find(part), std::string::npos) << part << " not in: " << message;
}

TEST(Open, AnImpossibleCameraIsCode3AndNamesTheKey) {
  const auto refusal = [](auto change) {
    Settings settings;
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
  EXPECT_NE(refusal([](CameraModel& c) { c.k1 = -1; }).find("k1"), std::string::npos);
  EXPECT_EQ(refusal([](CameraModel& c) { c.cx = 0; }), "") << "odd, but it can be undone";
  EXPECT_NE(refusal([](CameraModel& c) { c.cx = -1; }).find("cx"), std::string::npos);
  EXPECT_NE(refusal([](CameraModel& c) { c.fx = 0; }).find("fx"), std::string::npos);
  EXPECT_NE(refusal([](CameraModel& c) { c.fy = NAN; }).find("fy"), std::string::npos);
  for (const int size : {0, -1, std::numeric_limits<int>::min(), std::numeric_limits<int>::max()}) {
    EXPECT_NE(refusal([&](CameraModel& c) { c.width = size; }).find("width"), std::string::npos);
    EXPECT_NE(refusal([&](CameraModel& c) { c.height = size; }).find("height"), std::string::npos);
  }
}

TEST(Open, AModelThatIsNoneIsCode5WithoutAChildProcess) {
  static std::atomic<int> forks{0};
  pthread_atfork([] { ++forks; }, nullptr, nullptr);
#if defined(__SANITIZE_ADDRESS__)
  const __lsan::ScopedDisabler
      readers;  // OpenVINO unloads those of other formats with 8 bytes left
#endif
  const testing::TempFolder folder;
  testing::write(folder.path() / "garbage.onnx", "no network");
  Settings settings = settings_for(film("static_xyz"));
  for (const char* name : {"garbage.onnx", "absent.onnx"}) {
    settings.model = (folder.path() / name).string();
    std::string message;
    EXPECT_EQ(code_of([&] { Slam::open(settings); }, &message), 5);
    EXPECT_NE(message.find(name), std::string::npos) << message;
  }
  settings.model.clear();
  settings.dynamic = "semantic";
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 5) << "a mode that needs one";
  EXPECT_EQ(forks, 0);
}

TEST(Open, AnyKeyOfConfigIsTakenAndTheModeFollowsOptionsModelAndArgument) {
  Settings settings = settings_for(film("static_xyz"));
  settings.options["dynamic.mode"] = "off";
  const Record off = run(settings, film("static_xyz"));
  for (const Result& r : off.results) EXPECT_EQ(r.dynamic_points, 0);
  settings.dynamic = "semantic";  // says more than the option
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 5);
}

TEST(Process, FollowsTheCamera) {
  const Film& seen = film("static_xyz");
  const Record record = run(settings_for(seen), seen);
  const SE3 T_start = seen.frames[0]->T_world_camera;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Result& r = record.results[i];
    EXPECT_EQ(r.state, State::kTracking);
    EXPECT_GT(r.inliers, 30);
    EXPECT_GT(r.static_points + (i == 0 ? r.unknown_points : 0), 100) << "nothing moved yet";
    EXPECT_EQ(r.mask_age_frames, -1) << "there are no masks";
    const Vec3 truth = (T_start.inverse() * seen.frames[i]->T_world_camera).t();
    const auto& t = r.T_world_camera.translation_m;
    EXPECT_LT((truth - Vec3(t[0], t[1], t[2])).norm(), 0.03);
    double norm = 0;
    for (const double q : r.T_world_camera.rotation_xyzw) norm += q * q;
    EXPECT_NEAR(norm, 1, 1e-9);
  }
  ASSERT_EQ(record.outcome.trajectory.size(), seen.size());
  EXPECT_EQ(record.outcome.trajectory.back().t_ns, seen[seen.size() - 1].t_ns);
  EXPECT_GT(record.outcome.static_map.size(), 500U);
}

TEST(Process, ARollingShutterThatIsToldIsUndone) {
  const Film& seen = film("walking_rpy");
  const SE3 T_start = seen.frames[0]->T_world_camera;
  const auto error_m = [&](double readout_ms) {
    Settings settings = settings_for(seen);
    settings.deterministic = true;
    settings.camera.colour_readout_ms = settings.camera.depth_readout_ms = readout_ms;
    settings.camera.shutter_known = true;
    const Record record = run(settings, seen);
    double sum = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const auto& t = record.results[i].T_world_camera.translation_m;
      const Vec3 truth = (T_start.inverse() * seen.frames[i]->T_world_camera).t();
      sum += (truth - Vec3(t[0], t[1], t[2])).norm();
    }
    return sum / static_cast<double>(seen.size());
  };
  const double global_m = error_m(0);
  const double told_m = error_m(40);
  std::printf("mean error %.1f mm as global, %.1f mm told\n", 1e3 * global_m, 1e3 * told_m);
  EXPECT_LT(told_m, 0.6 * global_m);
}

TEST(Process, BadFramesAreCode4AndLeaveTheRunAsItWas) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  const Record undisturbed = run(settings, seen);
  Slam slam = Slam::open(settings);
  Record record;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    Frame bad = seen[i];
    bad.rgb = nullptr;
    EXPECT_EQ(code_of([&] { slam.process(bad); }), 4);
    bad = seen[i];
    bad.depth_m = nullptr;
    EXPECT_EQ(code_of([&] { slam.process(bad); }), 4);
    bad = seen[i];
    bad.t_ns = std::numeric_limits<std::int64_t>::max();
    EXPECT_EQ(code_of([&] { slam.process(bad); }), 4);
    record.results.push_back(slam.process(seen[i]));
    EXPECT_EQ(code_of([&] { slam.process(seen[i]); }), 4) << "the same stamp again";
    bad.t_ns = std::numeric_limits<std::int64_t>::min();
    EXPECT_EQ(code_of([&] { slam.process(bad); }), 4);
  }
  expect_same(slam.finish(), undisturbed.outcome);
}

TEST(Process, DepthThatIsNoneInAnyWayIsNone) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  const float none[] = {0, NAN, -1, INFINITY, -INFINITY, 1e30F};
  std::vector<Outcome> outcomes;
  for (int trial = 0; trial < 2; ++trial) {  // all kinds, then zero alone
    Slam slam = Slam::open(settings);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const DepthImage& whole = seen.frames[i]->frame->depth_m;
      std::vector<float> depth_m(whole.begin(), whole.end());
      for (std::size_t k = i; k < depth_m.size(); k += 7)
        depth_m[k] = trial == 0 ? none[k % std::size(none)] : 0;
      Frame frame = seen[i];
      frame.depth_m = depth_m.data();
      const Result r = slam.process(frame);
      for (const double t : r.T_world_camera.translation_m) EXPECT_TRUE(std::isfinite(t));
    }
    outcomes.push_back(slam.finish());
  }
  expect_same(outcomes[0], outcomes[1]);
}

TEST(Process, WithNothingToSeeTheStateSaysSo) {
  Settings settings;
  settings.camera = {
      .fx = 300, .fy = 300, .cx = 160, .cy = 120, .width = kWidth, .height = kHeight};
  Slam slam = Slam::open(settings);
  const std::vector<std::uint8_t> black(3 * kWidth * kHeight);
  const std::vector<float> nothing(kWidth * kHeight, NAN);
  for (int i = 0; i < 5; ++i) {
    const Result r = slam.process({i * 50'000'000LL, black.data(), nothing.data()});
    EXPECT_EQ(r.state, State::kWaiting);
    EXPECT_EQ(r.inliers, 0);
  }
  const Outcome outcome = slam.finish();
  EXPECT_TRUE(outcome.trajectory.empty());
  EXPECT_TRUE(outcome.static_map.empty());
}

TEST(Process, ImagesOfAnySizeAreTaken) {
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 480}, {640, 3}, {33, 47}, {71, 65}}) {
    Settings settings;
    const double f = std::max(width, height);
    settings.camera = {
        .fx = f, .fy = f, .cx = width / 2.0, .cy = height / 2.0, .width = width, .height = height};
    if (f > 20.0 * std::min(width, height))
      settings.camera.fx = 5.0 * width, settings.camera.fy = 5.0 * height;
    Slam slam = Slam::open(settings);
    std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(width) * height);
    for (std::size_t i = 0; i < rgb.size(); ++i)
      rgb[i] = static_cast<std::uint8_t>(i * 2654435761U >> 13);
    const std::vector<float> depth_m(static_cast<std::size_t>(width) * height, 2.0F);
    for (int i = 0; i < 4; ++i) slam.process({i * 50'000'000LL, rgb.data(), depth_m.data()});
    slam.finish();
  }
}

TEST(Process, AMoverBecomesAnObjectWithItsPlaceAndVelocity) {
  const Film& seen = film("moving_box");
  const Record record = run(settings_for(seen), seen);
  bool found = false;
  for (const Result& r : record.results) {
    for (const Object& o : r.objects) {
      found = true;
      EXPECT_EQ(o.class_name, "unknown");
      EXPECT_GE(o.age_frames, 0);
      EXPECT_GE(o.missing_frames, 0);
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_LE(o.min_world_m[axis], o.max_world_m[axis]);
        EXPECT_TRUE(std::isfinite(o.velocity_world_mps[axis]));
      }
    }
  }
  EXPECT_TRUE(found);
}

TEST(Finish, MayBeCalledAgainAndAfterNothing) {
  const Film& seen = film("static_xyz");
  for (const bool deterministic : {false, true}) {
    Settings settings = settings_for(seen);
    settings.deterministic = deterministic;
    Slam slam = Slam::open(settings);
    for (std::size_t i = 0; i < 8; ++i) slam.process(seen[i]);
    const Outcome first = slam.finish();
    EXPECT_EQ(first.trajectory.size(), 8U);
    expect_same(slam.finish(), first);
    EXPECT_EQ(code_of([&] { slam.process(seen[8]); }), 2);
    expect_same(slam.finish(), first);
    Slam unused = Slam::open(settings);
    EXPECT_TRUE(unused.finish().trajectory.empty());
  }
}

TEST(Finish, GivesTheMapAloneWhereNoTrajectoryIsKept) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.keep_trajectory = false;
  const Outcome outcome = run(settings, seen).outcome;
  EXPECT_TRUE(outcome.trajectory.empty());
  EXPECT_GT(outcome.static_map.size(), 500U);
}

TEST(Slam, AnObjectThatWasMovedFromSaysSo) {
  const Film& seen = film("static_xyz");
  Slam first = Slam::open(settings_for(seen));
  first.process(seen[0]);
  Slam second = std::move(first);
  EXPECT_EQ(code_of([&] { first.process(seen[1]); }), 2);  // NOLINT: that is the question
  EXPECT_EQ(code_of([&] { first.finish(); }), 2);
  second.process(seen[1]);
  first = Slam::open(settings_for(seen));  // a new one in its place
  first.process(seen[0]);
  second = std::move(first);  // ends the one that was there
  second.process(seen[1]);
  Slam& itself = second;
  second = std::move(itself);
  EXPECT_EQ(second.finish().trajectory.size(), 2U);
}

TEST(Slam, TheSameInputTwiceAndTwoAtOnceGiveTheSame) {
  const Film &still = film("static_xyz"), &moving = film("moving_box");
  Settings of_still = settings_for(still), of_moving = settings_for(moving);
  of_still.deterministic = of_moving.deterministic = true;
  const Record still_alone = run(of_still, still), moving_alone = run(of_moving, moving);
  Record still_beside, moving_beside;
  {
    const std::jthread other([&] { moving_beside = run(of_moving, moving); });
    still_beside = run(of_still, still);
  }
  expect_same(still_beside.outcome, still_alone.outcome);
  expect_same(moving_beside.outcome, moving_alone.outcome);
  for (std::size_t i = 0; i < moving.size(); ++i) {
    EXPECT_TRUE(
        same(moving_beside.results[i].T_world_camera, moving_alone.results[i].T_world_camera));
    EXPECT_EQ(moving_beside.results[i].objects.size(), moving_alone.results[i].objects.size());
  }
}

TEST(Slam, TwoInOneThreadTakeTurnsWithoutNoticing) {
  const Film& seen = film("static_xyz");
  Settings settings = settings_for(seen);
  settings.deterministic = true;
  const Record alone = run(settings, seen);
  Slam a = Slam::open(settings), b = Slam::open(settings);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    a.process(seen[i]);
    b.process(seen[i]);
  }
  expect_same(a.finish(), alone.outcome);
  expect_same(b.finish(), alone.outcome);
}

/// Collects lines from any thread.
struct Lines {
  std::mutex mutex;
  std::vector<std::string> warnings;
  [[nodiscard]] std::function<void(LogLevel, const std::string&)> sink() {
    return [this](LogLevel level, const std::string& line) {
      const std::lock_guard lock(mutex);
      if (level == LogLevel::kWarning) warnings.push_back(line);
      throw std::runtime_error("which harms nobody");
    };
  }
};

/// A model path leads to no line; a segmenter that fails does. Without a network at hand the only
/// way to a warning is a model: this is skipped without one.
TEST(SaveMap, AnotherObjectGoesOnWithTheMapOrIsPlacedInIt) {
  const Film& room = film("static_xyz");
  const ygslam::testing::TempFolder folder;
  Settings settings = settings_for(room);
  settings.deterministic = true;
  settings.load_map = (folder.path() / "room.ygmap").string();
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 6) << "not there yet";
  {
    Settings first = settings;
    first.load_map.clear();
    Slam slam = Slam::open(first);
    for (std::size_t i = 0; i < room.size(); ++i) (void)slam.process(room[i]);
    slam.save_map(settings.load_map);
    EXPECT_EQ(code_of([&] { slam.save_map((folder.path() / "none" / "room").string()); }), 9);
    (void)slam.finish();
    slam.save_map(settings.load_map);
  }
  for (const bool localize_only : {false, true}) {
    settings.localize_only = localize_only;
    Slam slam = Slam::open(settings);
    const std::size_t keyframes = slam.map().keyframes.size();
    EXPECT_GT(keyframes, 0U);
    for (std::size_t i = 0; i < room.size(); ++i) {
      const Result result = slam.process(room[i]);
      EXPECT_EQ(result.state, State::kTracking) << i;
      if (i > 0) continue;
      for (const double t_m : result.T_world_camera.translation_m) EXPECT_NEAR(t_m, 0, 0.01);
    }
    if (localize_only) {
      EXPECT_EQ(slam.map().keyframes.size(), keyframes);
    }
  }
  settings.camera.fx += 40;
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 6) << "another camera";
  settings.load_map.clear();
  EXPECT_EQ(code_of([&] { Slam::open(settings); }), 2) << "nothing to localise in";
}

TEST(Slam, WithoutTroubleNothingIsWritten) {
  const Film& seen = film("moving_box");
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  run(settings_for(seen), seen);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

#if !defined(__SANITIZE_ADDRESS__)  // a network's threads load a library in a way it refuses
TEST(Slam, LogLinesGoToTheCallbackOfTheirObjectAndNothingToStandardOutput) {
  const std::string model = ygslam::testing::shared_folder() / "models/yolov8n-seg_480x640.onnx";
  YGSLAM_NEEDS_RECORDED(model);
  const Film& seen = film("moving_box");
  Settings settings = settings_for(seen);
  settings.model = model;
  // Input time without a mask: the next frame comes 30 s later and the first mask is not awaited.
  settings.options = {{"run.first_mask_timeout_s", "0"}};
  const auto provoke = [&](Slam& slam) {
    for (std::size_t i = 0; i < 4; ++i) {
      Frame frame = seen[i];
      frame.t_ns += static_cast<std::int64_t>(i) * 30'000'000'000;
      slam.process(frame);
    }
    slam.finish();
  };
  Lines of_one, of_two;
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  {
    settings.log = of_one.sink();
    Slam one = Slam::open(settings);
    settings.log = of_two.sink();
    Slam two = Slam::open(settings);
    provoke(one);
  }
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << "the callback has it";
  EXPECT_FALSE(of_one.warnings.empty());
  EXPECT_TRUE(of_two.warnings.empty());
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  settings.log = nullptr;
  Slam silent = Slam::open(settings);
  provoke(silent);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_NE(::testing::internal::GetCapturedStderr().find("warning: "), std::string::npos);
}
#endif

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// In a child each: less and less memory beyond what is in use. Whatever does not fit is an Error.
TEST(Slam, WantOfMemoryIsCode1AndNeverTheEnd) {
  const Film& seen = film("static_xyz");
  int refused = 0;
  for (const std::size_t extra_mb : {400, 200, 100, 60, 40, 25, 15, 8, 4, 2}) {
    const auto child = [&] {
      ygslam::testing::limit_memory(extra_mb);
      // What earlier work left to the allocator counts as well: all is taken, then as much given
      // back as there is to be.
      std::vector<std::unique_ptr<char[]>> taken;
      taken.reserve(1 << 16);
      try {
        while (taken.size() < taken.capacity()) taken.emplace_back(new char[1 << 20]);
      } catch (const std::bad_alloc&) {
      }
      taken.resize(taken.size() - std::min(taken.size(), extra_mb));
      try {
        run(settings_for(seen), seen);
        std::_Exit(0);
      } catch (const Error& e) {
        std::_Exit(e.code == 1 && std::string(e.what()) == "out of memory" ? 1 : 2);
      }
    };
    refused += ygslam::testing::refusals_of(child, extra_mb);
  }
  EXPECT_GT(refused, 0) << "no limit was low enough: the test tests nothing";
}
#endif

}  // namespace
}  // namespace ygslam::api
