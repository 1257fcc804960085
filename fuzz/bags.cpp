#include "bag/bag_sequence.hpp"

#include <algorithm>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "io/frame_loader.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam::fuzz {

void bags(std::string_view bytes) {
  static const testing::TempFolder kFolder("ygslam-fuzz-bag");
  const auto path = kFolder.path() / "bag";
  testing::write(path, bytes);
  CameraConfig camera;
  camera.fx = camera.fy = 10;
  camera.width = camera.height = 0;
  for (const auto& given : {std::optional<CameraConfig>(), std::optional(camera)}) {
    const auto sequence = open_bag_sequence(path, {}, given);
    if (!sequence.ok()) {
      CHECK(sequence.error().message.find('\n') == std::string::npos, "a fault is one line");
      continue;
    }
    CHECK(!sequence->pairs.empty());
    for (std::size_t i = 0; i < std::min<std::size_t>(sequence->pairs.size(), 4); ++i) {
      CHECK(i == 0 || sequence->pairs[i - 1].stamp < sequence->pairs[i].stamp);
      const auto frame = load_frame(*sequence, i);
      if (!frame.ok()) continue;
      CHECK(frame.value().colour.width() == sequence->camera.width &&
            frame.value().depth_m.height() == sequence->camera.height);
    }
  }
}

}  // namespace ygslam::fuzz
