// Feeds a camera that slides past a textured wall and prints where YG-SLAM thinks it is.
#include <cstdio>
#include <vector>
#include <ygslam/slam.hpp>

int main(int argc, char** argv) {
  ygslam::api::Settings settings;
  settings.camera = {.fx = 525, .fy = 525, .cx = 319.5, .cy = 239.5};
  if (argc > 1) settings.model = argv[1];  // a segmentation network; without one: geometry alone
  try {
    auto slam = ygslam::api::Slam::open(settings);
    std::vector<std::uint8_t> rgb(640 * 480 * 3);
    const std::vector<float> depth_m(640 * 480, 2.0F);
    for (int i = 0; i < 30; ++i) {
      for (int p = 0; p < 640 * 480; ++p) {  // blocks of random brightness, moving 2 px a frame
        const unsigned cell = ((p % 640 + 2 * i) / 12) * 7919U + (p / 640 / 12) * 104729U;
        rgb[3 * p] = rgb[3 * p + 1] = rgb[3 * p + 2] = (cell * 2654435761U) >> 24;
      }
      const auto result = slam.process({i * 33'333'333LL, rgb.data(), depth_m.data()});
      const auto& t = result.T_world_camera.translation_m;
      std::printf("%2d  x %.3f  y %.3f  z %.3f m  %d inliers\n", i, t[0], t[1], t[2],
                  result.inliers);
    }
    std::printf("map: %zu points\n", slam.finish().static_map.size());
  } catch (const ygslam::api::Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return e.code;
  }
}
