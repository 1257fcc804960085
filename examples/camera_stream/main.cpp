// A camera in a program of its own: `camera_stream | ygslam run - --out OUT --realtime --view`.
//
//   camera_stream [SECONDS]     a camera that slides past a textured wall, 30 images a second
//
// Put your camera's calls in the place of see(). Needs one header: ygslam/camera_stream.hpp.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>
#include <ygslam/camera_stream.hpp>

namespace {

struct Picture {
  std::vector<std::uint8_t> rgb = std::vector<std::uint8_t>(640 * 480 * 3);
  std::vector<std::uint16_t> depth_mm = std::vector<std::uint16_t>(640 * 480, 2000);
};

/// Blocks of random brightness, two metres away, that move 2 px to the left from image to image.
void see(int image, Picture& picture) {
  for (int p = 0; p < 640 * 480; ++p) {
    const unsigned cell = ((p % 640 + 2 * image) / 12) * 7919U + (p / 640 / 12) * 104729U;
    const auto value = static_cast<std::uint8_t>((cell * 2654435761U) >> 24);
    for (int channel = 0; channel < 3; ++channel) picture.rgb[3 * p + channel] = value;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int images = static_cast<int>(30 * (argc > 1 ? std::atof(argv[1]) : 3600));
  const auto period = std::chrono::nanoseconds(33'333'333);
  const auto start = std::chrono::steady_clock::now();
  ygslam::CameraStream stream(stdout, {640, 480, 525, 525, 319.5, 239.5});
  Picture picture;
  for (int i = 0; i < images; ++i) {
    see(i, picture);
    std::this_thread::sleep_until(start + i * period);
    if (!stream.write(i * period.count(), picture.rgb.data(), picture.depth_mm.data())) return 1;
  }
}
