#include "simulation/world_config.hpp"

#include <gtest/gtest.h>

namespace ygslam::sim {
namespace {

std::string fault_of(const std::string& yaml) {
  const Result<WorldConfig> world = parse_world(yaml, "my.yaml");
  return world ? "" : world.error().message;
}

TEST(WorldFile, WrongKeyIsNamedWithItsLine) {
  const std::string fault = fault_of("layout: office\ncamera:\n  path: xyz\n  hight: 3\n");
  EXPECT_NE(fault.find("my.yaml:4"), std::string::npos) << fault;
  EXPECT_NE(fault.find("'hight'"), std::string::npos) << fault;
}

TEST(WorldFile, FaultyFilesAreRefusedWithALine) {
  for (const char* yaml :
       {"layout: moon\n", "seconds: -1\nlayout: office\n", "seconds: soon\nlayout: office\n",
        "rooms: 3\n", "rooms: [{low: [0, 0], high: [0, 1]}]\n",
        "layout: office\nfurniture: [{kind: spaceship}]\n",
        "layout: office\ncamera: {path: walk}\n", "layout: office\nintrinsics: {fx: .nan}\n",
        "layout: office\nmovers: [{kind: ball, motion: push}]\n",
        "layout: office\nmovers: [{kind: carton, motion: carry, person: nobody}]\n",
        "layout: office\npeople: [{actions: [{do: walk}]}]\n",
        "layout: office\npeople: [{actions: [{do: fly}]}]\n", "[1, 2]\n", "a: [\n", ""}) {
    const std::string fault = fault_of(yaml);
    EXPECT_EQ(fault.rfind("my.yaml:", 0) == 0 || fault.rfind("layouts/", 0) == 0, true)
        << yaml << " -> " << fault;
  }
}

TEST(WorldFile, AUsersWorldNeedsOnlyARoom) {
  const Result<WorldConfig> world =
      parse_world("rooms: [{low: [0, 0], high: [4, 5], height: 3}]\n", "my.yaml");
  ASSERT_TRUE(world.ok()) << world.error().message;
  EXPECT_EQ(world->rooms.size(), 1U);
}

}  // namespace
}  // namespace ygslam::sim
