// Every corpus of the fuzzers, and thousands of inputs that once broke something, through the same
// functions in every build.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "core/log.hpp"
#include "fuzz/targets.hpp"

namespace ygslam::fuzz {
namespace {

struct Target {
  const char* name;
  void (*run)(std::string_view);
};

class Replay : public ::testing::TestWithParam<Target> {};

TEST_P(Replay, EveryInputOfTheCorpusIsTakenOrRefused) {
  const log::ScopedSink silence(
      std::make_shared<const log::Sink>([](log::Level, const std::string&) {}));
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(YGSLAM_FUZZ_CORPUS) +
                                                               "/" + GetParam().name)) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    EXPECT_NO_THROW(GetParam().run(bytes)) << entry.path();
    ++count;
  }
  EXPECT_GT(count, 2);
}

INSTANTIATE_TEST_SUITE_P(
    Fuzz, Replay,
    ::testing::Values(Target{"settings", settings}, Target{"calibration", calibration},
                      Target{"worlds", worlds}, Target{"lists", lists},
                      Target{"trajectories", trajectories}, Target{"png", png},
                      Target{"jpeg", jpeg}, Target{"instances", instances}, Target{"sweep", sweep},
                      Target{"map_file", map_file}, Target{"map_rows", map_rows},
                      Target{"surface_ply", surface_ply}, Target{"objects", objects},
                      Target{"live_requests", live_requests}, Target{"bags", bags},
                      Target{"messages", messages}, Target{"image_files", image_files},
                      Target{"poses", poses}, Target{"network_outputs", network_outputs},
                      Target{"inertial", inertial}),
    [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace ygslam::fuzz
