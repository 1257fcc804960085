#include "fuzz/map_questions.hpp"
#include "fuzz/targets.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam::fuzz {

void map_file(std::string_view bytes) {
  static const testing::TempFolder kFolder("ygslam-fuzz-map-file");
  const auto path = kFolder.path() / "room.map";
  testing::write(path, bytes);
  ask_map_file(path);
  for (const auto& left : std::filesystem::directory_iterator(kFolder.path()))
    std::filesystem::remove(left);
}

}  // namespace ygslam::fuzz
