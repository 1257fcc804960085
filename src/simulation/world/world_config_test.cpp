#include "simulation/world/world_config.hpp"

#include <gtest/gtest.h>

#include "simulation/embedded_files.hpp"

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

TEST(WorldFile, AKeyThatIsThereTwiceIsNamedWithTheLineOfTheSecond) {
  const std::string fault = fault_of("layout: office\nfps: 30\nseconds: 3\nfps: 10\n");
  EXPECT_EQ(fault.rfind("my.yaml:4: ", 0), 0U) << fault;
  EXPECT_NE(fault.find("'fps'"), std::string::npos) << fault;
}

TEST(WorldFile, FaultyFilesAreRefusedWithALine) {
  for (const char* yaml :
       {"layout: moon\n",
        "seconds: -1\nlayout: office\n",
        "seconds: soon\nlayout: office\n",
        "rooms: 3\n",
        "rooms: [{low: [0, 0], high: [0, 1]}]\n",
        "layout: office\nfurniture: [{kind: spaceship}]\n",
        "layout: office\ncamera: {path: walk}\n",
        "layout: office\nintrinsics: {fx: .nan}\n",
        "layout: office\nmovers: [{kind: ball, motion: push}]\n",
        "layout: office\nmovers: [{kind: carton, motion: carry, person: nobody}]\n",
        "layout: office\npeople: [{actions: [{do: walk}]}]\n",
        "layout: office\npeople: [{actions: [{do: fly}]}]\n",
        "layout: office\nfps: 30\nfps: 10\n",
        "layout: office\ncamera: {speed: 1000000000}\n",
        "layout: office\ncamera: {speed: -1}\n",
        "layout: office\nambient: -1\n",
        "layout: office\nmovers: [{kind: ball, size: [0, 1, 1], stations: [{t: 0}]}]\n",
        "layout: office\npeople: [{actions: [{do: stand, seconds: -2}]}]\n",
        "layout: office\npeople: [{actions: [{do: walk, via: [[10000, 0]]}]}]\n",
        "layout: office\ncamera: {kidnaps: [{from: 4, until: 2}]}\n",
        "layout: office\npeople: [{body: 6}]\n",
        "layout: office\npeople: [{body: -1}]\n",
        "layout: office\npeople: [{skin: -1}]\n",
        "layout: office\npeople: [{top_variant: -3}]\n",
        "layout: office\npeople: [{name: a}]\nmovers: [{kind: carton, motion: carry, person: a, "
        "from: 4, until: 2}]\n",
        "[1, 2]\n",
        "a: [\n",
        ""}) {
    const std::string fault = fault_of(yaml);
    EXPECT_EQ(fault.rfind("my.yaml:", 0) == 0 || fault.rfind("layouts/", 0) == 0, true)
        << yaml << " -> " << fault;
  }
}

// Every prefix and every damaged byte of a real world is either a world or refused with its name.
TEST(WorldFile, OneThatCannotBeReadIsNoUnknownWorld) {
  const auto missing = load_world("no/such_world.yaml");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().kind, ErrorKind::kInput);
  EXPECT_EQ(missing.error().message, "no/such_world.yaml: no such file");
  const auto unknown = load_world("no/such_world");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().kind, ErrorKind::kUsage);
  EXPECT_NE(unknown.error().message.find("known worlds: "), std::string::npos);
}

TEST(WorldFile, CorruptFilesAreRefusedOrHarmless) {
  const auto whole = embedded_file("moved_chair.yaml");
  ASSERT_TRUE(whole.has_value());
  int refused = 0;
  const auto check = [&](const std::string& yaml) {
    const std::string fault = fault_of(yaml);
    if (fault.empty()) return;
    ++refused;
    ASSERT_TRUE(fault.rfind("my.yaml:", 0) == 0 || fault.rfind("layouts/", 0) == 0) << fault;
    ASSERT_EQ(fault.find('\n'), std::string::npos) << fault;
  };
  for (std::size_t size = 0; size < whole->size(); size += 37)
    check(std::string(whole->substr(0, size)));
  for (std::size_t at = 5; at < whole->size(); at += 29) {
    for (const char damage : {'\0', '\xff', '{', ':', '&', '\t'}) {
      std::string yaml(*whole);
      yaml[at] = damage;
      check(yaml);
    }
  }
  EXPECT_GT(refused, 50);
}

TEST(WorldFile, TheEveningIsTheOfficeOfTheDayInDimmerLightWithOtherPeople) {
  const Result<WorldConfig> day = load_world("office_day");
  const Result<WorldConfig> evening = load_world("office_evening");
  ASSERT_TRUE(day.ok() && evening.ok());
  EXPECT_LT(evening->ambient, 0.5 * day->ambient);
  ASSERT_GT(evening->furniture.size(), 40U);
  for (std::size_t i = 0; i < evening->furniture.size(); ++i)
    EXPECT_EQ(evening->furniture[i].at, day->furniture[i].at) << i;
  ASSERT_GE(evening->people.size(), 2U);
  for (const PersonPlan& person : evening->people)
    for (const PersonPlan& other : day->people) EXPECT_NE(person.name, other.name);
}

TEST(WorldFile, AUsersWorldNeedsOnlyARoom) {
  const Result<WorldConfig> world =
      parse_world("rooms: [{low: [0, 0], high: [4, 5], height: 3}]\n", "my.yaml");
  ASSERT_TRUE(world.ok()) << world.error().message;
  EXPECT_EQ(world->rooms.size(), 1U);
}

}  // namespace
}  // namespace ygslam::sim
