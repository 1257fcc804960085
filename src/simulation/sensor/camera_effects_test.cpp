// What a real camera does beside the pinhole: rows one after the other, a lens, a wandering
// exposure.
#include <algorithm>
#include <cmath>

#include "simulation/sequence/test_worlds.hpp"

namespace ygslam::sim {
namespace {

double mean_code(const ColourImage& image) {
  double sum = 0;
  for (const Rgb8& p : image) sum += p.g;
  return sum / static_cast<double>(image.size());
}

TEST(RollingExposure, EachRowShowsWhatTheCameraSawAtItsOwnTime) {
  SequenceOptions options = small_options(1, 5);
  options.without_people = true;
  options.rolling = 0.8;
  SequenceSource source = open_or_die("walking_rpy", options);
  Renderer renderer(source.scene(), source.camera(), {});
  const int height = source.camera().height();
  int differs_from_middle = 0;
  for (const SimulatedFrame& frame : all_frames(open_or_die("walking_rpy", options))) {
    const View at_middle =
        renderer.render({frame.T_world_camera}, frame.T_world_camera, frame.t_s, frame.t_s);
    for (const int row : {0, height / 3, height - 1}) {
      const double late_s = ((row + 0.5) / height - 0.5) * options.rolling / source.fps();
      const SE3 T_world_camera = source.T_world_camera(frame.t_s + late_s);
      const View then = renderer.render({T_world_camera}, T_world_camera, frame.t_s, frame.t_s);
      for (int u = 0; u < source.camera().width(); ++u) {
        const float seen_m = frame.depth_true_m.at(u, row);
        ASSERT_NEAR(seen_m, then.depth_m.at(u, row), 2e-4F) << "row " << row << " column " << u;
        differs_from_middle += std::abs(seen_m - at_middle.depth_m.at(u, row)) > 2e-4F ? 1 : 0;
      }
    }
  }
  EXPECT_GT(differs_from_middle, 500);
}

TEST(LensDistortion, APixelSeesWhatItsIdealPixelSees) {
  SequenceOptions options = small_options(1, 1);
  const auto ideal = all_frames(open_or_die("static_xyz", options));
  options.distortion = true;
  SequenceSource source = open_or_die("static_xyz", options);
  const Camera camera = source.camera();
  ASSERT_TRUE(camera.config().is_distorted());
  const auto bent = all_frames(std::move(source));
  const DepthImage& straight_m = ideal[0].depth_true_m;
  int tested = 0, agree = 0, agree_undistorted = 0;
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const Vec2 ideal_px = camera.undistort(Vec2(u, v));
      if (!camera.contains(ideal_px, 1) || (ideal_px - Vec2(u, v)).norm() < 2) continue;
      const float bent_m = bent[0].depth_true_m.at(u, v);
      const auto agrees = [&](const Vec2& px) {
        const float m = straight_m.at(static_cast<int>(std::lround(px.x())),
                                      static_cast<int>(std::lround(px.y())));
        return std::abs(m - bent_m) < 0.01F * bent_m;
      };
      ++tested;
      agree += agrees(ideal_px) ? 1 : 0;
      agree_undistorted += agrees(Vec2(u, v)) ? 1 : 0;
    }
  }
  ASSERT_GT(tested, 500);
  EXPECT_GT(agree, tested * 88 / 100);  // the rest lies at edges
  EXPECT_LT(agree_undistorted, agree - tested / 20);
}

TEST(ExposureDrift, ChangesTheBrightnessAndNothingElse) {
  SequenceOptions options = small_options(12, 1);
  options.without_movers = true;
  const auto steady = all_frames(open_or_die("walking_static", options));
  options.exposure_drift = 0.3;
  const auto wandering = all_frames(open_or_die("walking_static", options));
  const auto range = [](const std::vector<SimulatedFrame>& frames) {
    std::vector<double> means;
    for (const SimulatedFrame& frame : frames) means.push_back(mean_code(frame.frame->colour));
    const auto [low, high] = std::minmax_element(means.begin(), means.end());
    return *high / *low;
  };
  EXPECT_LT(range(steady), 1.03);
  EXPECT_GT(range(wandering), 1.12);
  for (std::size_t i = 0; i < steady.size(); ++i)
    EXPECT_TRUE(same_pixels(steady[i].frame->depth_m, wandering[i].frame->depth_m));
}

}  // namespace
}  // namespace ygslam::sim
