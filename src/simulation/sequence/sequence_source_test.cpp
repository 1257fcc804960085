#include "simulation/sequence/sequence_source.hpp"

#include <algorithm>
#include <cmath>

#include "image/depth.hpp"
#include "simulation/sequence/test_worlds.hpp"

namespace ygslam::sim {
namespace {

std::size_t count_set(const GreyImage& image) {
  return static_cast<std::size_t>(
      std::count_if(image.begin(), image.end(), [](auto v) { return v != 0; }));
}

TEST(RenderedWorld, RepeatsToTheBitWithOneSeedAndDiffersWithAnother) {
  SequenceOptions options = small_options(0.6, 5);
  options.noise = NoiseKind::kKinect;
  options.blur = 0.3;
  options.truth_static = true;
  const auto first = all_frames(open_or_die("walking_xyz", options));
  options.threads = 1;  // the number of threads must not matter either
  const auto again = all_frames(open_or_die("walking_xyz", options));
  options.seed = 2;
  const auto other = all_frames(open_or_die("walking_xyz", options));
  ASSERT_EQ(first.size(), 3U);
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_TRUE(same_pixels(first[i].frame->colour, again[i].frame->colour));
    EXPECT_TRUE(same_pixels(first[i].frame->depth_m, again[i].frame->depth_m));
    EXPECT_TRUE(same_pixels(first[i].ids, again[i].ids));
    EXPECT_TRUE(same_pixels(first[i].moving, again[i].moving));
    EXPECT_TRUE(same_pixels(first[i].rgb_static, again[i].rgb_static));
    EXPECT_EQ(first[i].T_world_camera.t(), again[i].T_world_camera.t());
    EXPECT_FALSE(same_pixels(first[i].frame->colour, other[i].frame->colour));
  }
}

TEST(RenderedWorld, CameraPathIsTheSameToTheBitWithoutPeople) {
  SequenceOptions options = small_options(1, 4);
  const auto with = all_frames(open_or_die("walking_halfsphere", options));
  options.without_people = true;
  const auto without = all_frames(open_or_die("walking_halfsphere", options));
  for (std::size_t i = 0; i < with.size(); ++i) {
    EXPECT_EQ(with[i].T_world_camera.t(), without[i].T_world_camera.t());
    EXPECT_EQ(with[i].T_world_camera.R(), without[i].T_world_camera.R());
    EXPECT_EQ(count_set(without[i].ids), 0U);
  }
}

TEST(RenderedWorld, ACameraThatACallerMovesAlongThePathSeesTheSame) {
  SequenceOptions options = small_options(0.6, 5);
  options.noise = NoiseKind::kKinect;
  const auto path = all_frames(open_or_die("walking_xyz", options));
  SequenceSource source = open_or_die("walking_xyz", options);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const SimulatedFrame frame = source.next_from(path[i].T_world_camera, path[i].t_s);
    EXPECT_EQ(frame.frame->stamp, path[i].frame->stamp);
    EXPECT_TRUE(same_pixels(frame.frame->colour, path[i].frame->colour));
    EXPECT_TRUE(same_pixels(frame.frame->depth_m, path[i].frame->depth_m));
    EXPECT_TRUE(i == 0 || same_pixels(frame.moving, path[i].moving));
  }
  const SimulatedFrame later = source.next_from(path[0].T_world_camera, 7.25);
  EXPECT_EQ(later.frame->stamp.ns - path[0].frame->stamp.ns, 7'250'000'000);
  EXPECT_EQ(later.T_world_camera.t(), path[0].T_world_camera.t());
}

/// Whether the pixel and its neighbours lie on one plane: there the inverse depth is linear.
bool is_plane(const DepthImage& depth_m, int u0, int v0) {
  const auto inverse = [&](int u, int v) { return 1.0 / static_cast<double>(depth_m.at(u, v)); };
  for (int v = v0; v <= v0 + 1; ++v) {
    for (int u = u0; u <= u0 + 1; ++u) {
      const double bend_u = inverse(u - 1, v) - 2 * inverse(u, v) + inverse(u + 1, v);
      const double bend_v = inverse(u, v - 1) - 2 * inverse(u, v) + inverse(u, v + 1);
      if (std::abs(bend_u) > 1e-5 || std::abs(bend_v) > 1e-5) return false;
    }
  }
  return true;
}

// A point seen in one frame lies on the surface that another frame sees there, or behind it.
TEST(RenderedWorld, DepthAndPoseAgreeBetweenFramesWithinAMillimetre) {
  SequenceSource source = open_or_die("static_xyz", small_options(3, 1));
  const Camera camera = source.camera();
  const auto frames = all_frames(std::move(source));
  const SimulatedFrame& a = frames[0];
  std::size_t tested = 0;
  std::size_t agree = 0;
  std::size_t in_front = 0;
  for (std::size_t f = 1; f < frames.size(); ++f) {
    const SimulatedFrame& b = frames[f];
    const SE3 T_b_a = b.T_world_camera.inverse() * a.T_world_camera;
    for (int v = 2; v < camera.height() - 2; ++v) {
      for (int u = 2; u < camera.width() - 2; ++u) {
        const Vec3 p_b =
            T_b_a * camera.unproject(Vec2(u, v), static_cast<double>(a.depth_true_m.at(u, v)));
        if (p_b.z() < 0.1) continue;
        const Vec2 uv = camera.project(p_b);
        if (!camera.contains(uv, 2)) continue;
        const int u0 = static_cast<int>(uv.x());
        const int v0 = static_cast<int>(uv.y());
        const double s = uv.x() - u0;
        const double t = uv.y() - v0;
        // On a plane the inverse depth is linear in the pixel.
        const auto inverse = [&](int x, int y) {
          return 1.0 / static_cast<double>(b.depth_true_m.at(x, y));
        };
        const double i00 = inverse(u0, v0), i10 = inverse(u0 + 1, v0), i01 = inverse(u0, v0 + 1),
                     i11 = inverse(u0 + 1, v0 + 1);
        if (!is_plane(b.depth_true_m, u0, v0)) continue;
        const double seen_m =
            1.0 / ((1 - t) * ((1 - s) * i00 + s * i10) + t * ((1 - s) * i01 + s * i11));
        ++tested;
        if (std::abs(seen_m - p_b.z()) < 1e-3) ++agree;
        if (seen_m > p_b.z() + 1e-3) ++in_front;
      }
    }
  }
  ASSERT_GT(tested, 10000U);
  EXPECT_GT(agree, tested * 85 / 100);  // the rest is hidden behind something
  EXPECT_LT(in_front, tested / 1000);   // nothing floats before a surface
}

TEST(RenderedWorld, StaticWorldsFlagNoMovingPixel) {
  for (const char* name : {"static_xyz", "room_walk", "corridor_loop", "twin_rooms",
                           "twin_rooms_return", "ring", "kidnap"}) {
    for (const SimulatedFrame& frame : all_frames(open_or_die(name, small_options(4, 1)))) {
      EXPECT_EQ(count_set(frame.moving), 0U) << name;
      EXPECT_EQ(count_set(frame.ids), 0U) << name;
    }
  }
}

// Things that are put elsewhere out of sight: no pixel moves, and the second lap looks different.
TEST(RenderedWorld, ThingsOfTheMovedRoomJumpOutOfSight) {
  const SequenceOptions options = small_options(60, 1);
  const auto moved = all_frames(open_or_die("moved_room", options));
  const auto unmoved = all_frames(open_or_die("unmoved_room", options));
  ASSERT_EQ(moved.size(), unmoved.size());
  int different = 0;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    EXPECT_EQ(count_set(moved[i].moving), 0U) << i;
    const bool same = same_pixels(moved[i].depth_true_m, unmoved[i].depth_true_m);
    if (i < 18) {
      EXPECT_TRUE(same) << i;
    }
    different += same ? 0 : 1;
  }
  EXPECT_GT(different, 4);
}

TEST(RenderedWorld, BoxIsFlaggedOnlyWhileItMoves) {
  const auto frames = all_frames(open_or_die("moving_box", small_options(8, 10)));
  std::size_t moving_frames = 0;
  for (const SimulatedFrame& frame : frames) {
    const std::size_t box = count_set(frame.ids);
    const std::size_t moving = count_set(frame.moving);
    const bool at_rest = frame.t_s <= 2 || (frame.t_s > 6.05 && frame.t_s <= 7);
    if (at_rest) {
      EXPECT_EQ(moving, 0U) << frame.t_s;
    }
    if (frame.t_s > 3.5 && frame.t_s < 4.5) {
      ASSERT_GT(box, 100U);
      EXPECT_EQ(moving, box) << frame.t_s;
      ++moving_frames;
    }
    for (std::size_t i = 0; i < frame.ids.size(); ++i) {
      ASSERT_TRUE(frame.moving.data()[i] == 0 || frame.ids.data()[i] != 0);
    }
  }
  EXPECT_GT(moving_frames, 5U);
}

TEST(RenderedWorld, MasksDepthAndStaticViewAgree) {
  SequenceOptions options = small_options(4, 1);
  options.truth_static = true;
  std::size_t person_pixels = 0;
  for (const SimulatedFrame& frame : all_frames(open_or_die("walking_static", options))) {
    for (std::size_t i = 0; i < frame.ids.size(); ++i) {
      const float with = frame.depth_true_m.data()[i];
      const float without = frame.depth_static_m.data()[i];
      if (frame.ids.data()[i] == 0) {
        ASSERT_EQ(with, without);
      } else {
        ++person_pixels;
        ASSERT_LT(with, without + 1e-4F);
      }
    }
  }
  EXPECT_GT(person_pixels, 500U);
}

// The shortcut (render again only where movers matter) against the plain way: not a bit differs.
TEST(RenderedWorld, StaticViewEqualsTheWorldWithoutMovers) {
  for (const char* name : {"crowd", "walking_xyz", "moved_chair"}) {
    SequenceOptions options = small_options(3, 2);
    options.truth_static = true;
    const auto with = all_frames(open_or_die(name, options));
    options.without_people = true;
    options.without_movers = true;
    const auto without = all_frames(open_or_die(name, options));
    std::size_t covered = 0;
    for (std::size_t i = 0; i < with.size(); ++i) {
      EXPECT_TRUE(same_pixels(with[i].depth_static_m, without[i].depth_true_m)) << name << i;
      EXPECT_TRUE(same_pixels(with[i].rgb_static, without[i].frame->colour)) << name << i;
      covered += count_set(with[i].ids);
    }
    EXPECT_GT(covered, 1000U) << name;
  }
}

TEST(RenderedWorld, VideoChangesItsLookButDoesNotMove) {
  const Result<WorldConfig> world = parse_world(
      "rooms: [{low: [-3, -3], high: [3, 3]}]\n"
      "camera: {path: static, jerk: 0, at: [0, 0, 1.2], look_at: [0, 2, 1.2]}\n"
      "furniture: [{kind: monitor, variant: 9, at: [0, 1, 0.9], size: [0.9, 0.05, 0.6]}]\n",
      "test");
  ASSERT_TRUE(world.ok()) << world.error().message;
  Result<SequenceSource> source = open_world(*world, small_options(1, 2));
  ASSERT_TRUE(source.ok());
  const auto frames = all_frames(std::move(*source));
  EXPECT_FALSE(same_pixels(frames[0].frame->colour, frames[1].frame->colour));
  EXPECT_TRUE(same_pixels(frames[0].depth_true_m, frames[1].depth_true_m));
  EXPECT_EQ(count_set(frames[1].moving), 0U);
}

TEST(KinectDepth, HasTheNoiseOfTheSensorHolesAndARange) {
  SequenceOptions options = small_options(1, 1);
  options.width = 320;
  options.height = 240;
  options.noise = NoiseKind::kKinect;
  const auto frames = all_frames(open_or_die("static_xyz", options));
  const SimulatedFrame& frame = frames[0];
  double sum = 0;
  std::size_t n = 0;
  std::size_t holes = 0;
  for (std::size_t i = 0; i < frame.depth_true_m.size(); ++i) {
    const auto truth = static_cast<double>(frame.depth_true_m.data()[i]);
    const auto seen = static_cast<double>(frame.frame->depth_m.data()[i]);
    if (seen == 0) {
      ++holes;
      continue;
    }
    EXPECT_GE(seen, 0.5);
    EXPECT_LE(seen, 8.0);
    const double error = seen - truth;
    if (std::abs(error) > 0.1 * truth) continue;  // the other side of an edge
    sum += error * error / std::pow(kinect_depth_sigma_m(truth), 2);
    ++n;
  }
  EXPECT_GT(std::sqrt(sum / static_cast<double>(n)), 0.6);
  EXPECT_LT(std::sqrt(sum / static_cast<double>(n)), 2.5);  // with quantisation and edges
  EXPECT_GT(holes, frame.depth_true_m.size() / 100);
  EXPECT_LT(holes, frame.depth_true_m.size() / 2);
}

TEST(RenderedWorld, UnknownNameListsTheKnownOnes) {
  const Result<SequenceSource> source = open_world("walking_xzy");
  ASSERT_FALSE(source.ok());
  EXPECT_EQ(source.error().kind, ErrorKind::kUsage);
  EXPECT_NE(source.error().message.find("walking_xyz"), std::string::npos);
}

TEST(RenderedWorld, EveryNamedWorldOpensAndRenders) {
  const auto worlds = known_worlds();
  EXPECT_GE(worlds.size(), 17U);
  for (const WorldName& world : worlds) {
    EXPECT_FALSE(world.description.empty()) << world.name;
    const auto frames = all_frames(open_or_die(world.name, small_options(0.5, 2)));
    const DepthImage& depth_m = frames.at(0).depth_true_m;
    const auto nothing = std::count(depth_m.begin(), depth_m.end(), 0.0F);
    EXPECT_EQ(nothing, 0) << world.name << ": the room has a gap";
  }
}

}  // namespace
}  // namespace ygslam::sim
