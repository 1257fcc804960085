#include "io/name_times.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <set>

#include "core/rng.hpp"

namespace ygslam {
namespace {

/// True times of a camera: 30 Hz with some jitter, a frame missing now and then.
std::vector<std::int64_t> camera_times_us(std::int64_t first_us, int count, double rate_hz = 30) {
  Rng rng(5);
  std::vector<std::int64_t> times;
  for (int i = 0; times.size() < static_cast<std::size_t>(count); ++i) {
    const double jitter_us = rng.uniform(-1000, 1000);
    if (rng.below(12) != 0)
      times.push_back(first_us + static_cast<std::int64_t>(1e6 * i / rate_hz + jitter_us));
  }
  return times;
}

template <typename... Args>
std::string text(const char* format, Args... args) {
  std::array<char, 128> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, args...);
  return buffer.data();
}

using Namer = std::function<std::string(std::int64_t us, int i)>;
constexpr std::int64_t kEpoch_us = 1'305'031'102'175'304;
constexpr std::int64_t kUptime_us = 7'175'304;

struct Form {
  const char* title;
  Namer name;
  std::int64_t first_us = kEpoch_us;
  bool keeps_epoch = true;  ///< else only differences of times are in the names
};

class TimesOfNames : public ::testing::TestWithParam<Form> {};

TEST_P(TimesOfNames, AreOfTheRightOrderAndSpan) {
  const Form& form = GetParam();
  for (const int count : {7, 24, 400, 3000}) {
    const auto times_us = camera_times_us(form.first_us, count);
    std::vector<std::string> names;
    for (int i = 0; i < count; ++i)
      names.push_back(form.name(times_us[static_cast<std::size_t>(i)], i));
    const auto read = times_of_names(names);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_FALSE(read->is_frames) << read->taken_as;
    const std::int64_t shift_ns =
        form.keeps_epoch ? 0 : read->stamps.front()->ns - 1000 * times_us.front();
    for (std::size_t i = 0; i < names.size(); ++i) {
      ASSERT_TRUE(read->stamps[i].has_value());
      ASSERT_NEAR(static_cast<double>(read->stamps[i]->ns - shift_ns - 1000 * times_us[i]), 0,
                  1.1e6)
          << names[i] << " as " << read->taken_as;
    }
  }
}

long long s_of(std::int64_t us) { return us / 1'000'000; }
long long rest_of(std::int64_t us) { return us % 1'000'000; }

const Form kForms[] = {
    {"TUM", [](auto us, int) { return text("%lld.%06lld", s_of(us), rest_of(us)); }},
    {"TUM uptime", [](auto us, int) { return text("%lld.%06lld", s_of(us), rest_of(us)); },
     kUptime_us},
    {"Bonn, zeros trimmed",
     [](auto us, int) {
       std::string name = text("%lld.%05lld", s_of(us), rest_of(us) / 10);
       while (name.back() == '0') name.pop_back();
       return name.back() == '.' ? name + "0" : name;
     }},
    {"sec_nsec padded",
     [](auto us, int) { return text("%lld_%09lld", s_of(us), 1000 * rest_of(us)); }},
    {"sec_nsec unpadded",
     [](auto us, int) { return text("%lld_%lld", s_of(us), 1000 * rest_of(us)); }},
    {"sec-nsec of uptime",
     [](auto us, int) { return text("cam0-%lld-%lld", s_of(us), 1000 * rest_of(us)); }, kUptime_us,
     false},
    {"video_sec.ms unpadded",
     [](auto us, int) { return text("video_%lld.%lld", s_of(us), rest_of(us) / 1000); }, kUptime_us,
     false},
    {"video_sec.ms padded",
     [](auto us, int) { return text("video_%lld.%03lld", s_of(us), rest_of(us) / 1000); },
     kUptime_us, false},
    {"sec_usec unpadded", [](auto us, int) { return text("%lld_%lld", s_of(us), rest_of(us)); }},
    {"Redwood", [](auto us, int i) { return text("%07d-%012lld", i + 1, (long long)us); }, 2000},
    {"Redwood begun later",
     [](auto us, int i) { return text("%07d-%012lld", i + 12, (long long)us); }, kUptime_us},
    {"number and stamp",
     [](auto us, int i) { return text("%06d_%lld.%06lld", i, s_of(us), rest_of(us)); }},
    {"stamp and number",
     [](auto us, int i) { return text("%lld%06lld_%d", s_of(us), rest_of(us), i); }},
    {"nanoseconds", [](auto us, int) { return text("%lld000", (long long)us); }},
    {"nanoseconds of uptime", [](auto us, int) { return text("%lld000", (long long)us); },
     kUptime_us},
    {"microseconds with a word", [](auto us, int) { return text("color_%lld", (long long)us); }},
    {"milliseconds", [](auto us, int) { return text("%lld", (long long)(us / 1000)); }},
    {"milliseconds of uptime",
     [](auto us, int) { return text("img%08lld", (long long)(us / 1000)); }, kUptime_us},
    {"with the size of the image",
     [](auto us, int) { return text("color_%lld_640x480", (long long)us); }},
};
INSTANTIATE_TEST_SUITE_P(Forms, TimesOfNames, ::testing::ValuesIn(kForms));

NameTimes frames_of(const std::vector<std::string>& names) {
  auto read = times_of_names(names);
  EXPECT_TRUE(read.ok()) << read.error().message;
  if (!read.ok()) return {};
  EXPECT_TRUE(read->is_frames) << read->taken_as;
  return std::move(read).value();
}

TEST(NumbersInNames, CountFramesWhateverStandsAroundThem) {
  for (const char* format : {"%d", "%06d", "frame-%06d.color", "color_%06d_640x480", "img (%d)",
                             "seq-01_frame%d", "cam2_%05d_v3"}) {
    std::vector<std::string> names;
    for (int i = 0; i < 200; ++i) names.push_back(text(format, i + 1));
    const auto read = frames_of(names);
    ASSERT_EQ(read.stamps.size(), 200U);
    EXPECT_EQ(read.stamps[0]->ns, 33'333'000) << format;
    EXPECT_EQ(read.stamps[59]->ns, 2'000'000'000) << format;
  }
}

TEST(NumbersInNames, MayBeFarApartWhereTheyAreNoTimes) {
  for (const int stride : {2, 5, 10, 20, 50, 100}) {
    std::vector<std::string> names;
    for (int i = 0; i < 100; ++i)
      if (i % 9 != 4) names.push_back(std::to_string(stride * i));
    const auto read = frames_of(names);
    EXPECT_EQ(read.stamps.back()->ns, 99 * stride * std::int64_t{1'000'000} / 30 * 1000);
    EXPECT_NE(read.taken_as.find(std::to_string(stride) + " apart"), std::string::npos);
  }
  const auto chosen = frames_of({"3", "5", "6", "11", "12", "13", "20", "21"});
  EXPECT_EQ(chosen.stamps.back()->ns, 700'000'000);
}

std::vector<std::string> named(int count, const std::function<std::string(int)>& name) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back(name(i));
  return names;
}

TEST(NumbersInNames, MayHaveAClockBesideThem) {
  EXPECT_EQ(frames_of(named(90, [](int i) { return text("frame_%06d_12-30-%02d", i, i / 30); }))
                .stamps.back()
                ->ns,
            89 * std::int64_t{1'000'000} / 30 * 1000);
  const auto in_a_minute = times_of_names(
      named(90, [](int i) { return text("12-30-%02d.%03d", i / 30, 33 * (i % 30)); }));
  ASSERT_TRUE(in_a_minute.ok()) << in_a_minute.error().message;
  EXPECT_EQ(in_a_minute->stamps.back()->ns, 2'957'000'000);
}

std::string refusal_of(const std::vector<std::string>& names) {
  const auto read = times_of_names(names);
  EXPECT_FALSE(read.ok()) << names.front() << " taken as " << read->taken_as;
  return read.ok() ? std::string() : read.error().message;
}

TEST(NumbersInNames, ThatAreNotClearAreRefusedWithTwoNames) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {named(50, [](int i) { return text("%d", 33 * i); }), "33 apart, or milliseconds"},
      {named(50, [](int i) { return text("%06d", 40 * i); }), "40 apart, or milliseconds"},
      {named(50, [](int i) { return text("%d", 200 * i); }), "far apart, or milliseconds"},
      {named(90, [](int i) { return text("seq%d_%03d", i / 30, i % 30); }), "no digits"},
      {named(90, [](int i) { return text("%02d.%02d", i / 30, i % 30); }), "no digits"},
      {named(50, [](int i) { return text("frame_%d_score_%d", i, i * 37 % 101); }), "order"},
      {named(50, [](int i) { return text("%d_%d", i, 50 - i); }), ", or "},
      {named(50, [](int i) { return text("%d_%d", i, 10 * i); }), ", or "},
      {named(150,
             [](int i) { return text("%02d%02d%02d", 14, 25 + (i + 30) / 60, (i + 30) % 60); }),
       "time of day"},
      {named(300, [](int i) { return text("2021-03-15-14-%02d-%02d", i / 60, i % 60); }),
       "time of day"},
      // Within seconds of one minute and the next.
      {named(40,
             [](int i) {
               return text("IMG_20240501_1%d_%03d", i < 20 ? 23059 : 23100, 50 * (i % 20));
             }),
       "time of day"},
      {named(40, [](int i) { return text("1%d%03d", i < 20 ? 23059 : 23100, 50 * (i % 20)); }),
       "time of day"},
      {named(40, [](int i) { return text("1%d.%03d", i < 20 ? 25959 : 30000, 50 * (i % 20)); }),
       "time of day"},
      {named(60, [](int i) { return text("12-30-%02d", i); }), "time of day; read are seconds"},
      {named(90, [](int i) { return text("rgb_09h%02dm%02ds", i / 60, i % 60); }), "time of day"},
      {named(90, [](int i) { return text("12_%02d_%02d.%d", i / 30, 2 * (i % 30), i % 10); }),
       "time of day"},
      {named(20, [](int i) { return text("%d", 7000 * i * i + i); }), "no digits"},
      {named(5, [](int i) { return text("9%021d", i * 7); }), "no digits"},
  };
  for (const auto& [names, why] : cases) {
    const std::string message = refusal_of(names);
    EXPECT_NE(message.find(why), std::string::npos) << message;
    EXPECT_NE(message.find("'" + names[0] + "'"), std::string::npos) << message;
    EXPECT_NE(message.find("'" + names[1] + "'"), std::string::npos) << message;
  }
}

TEST(NumbersInNames, NamesOfAnotherFormAreLeftOutAndNoCommonFormIsRefused) {
  const std::vector<std::string> one_cover = {"cover", "img_1", "img_2", "img_3", "thumb_2"};
  const auto read = frames_of(one_cover);
  EXPECT_FALSE(read.stamps[0].has_value());
  EXPECT_TRUE(read.stamps[3].has_value());
  EXPECT_FALSE(read.stamps[4].has_value());
  EXPECT_NE(refusal_of({"a1", "b2", "c3", "d4", "e5"}).find("no common form"), std::string::npos);
  EXPECT_NE(refusal_of({"cover", "title"}).find("no number"), std::string::npos);
  EXPECT_NE(refusal_of({}).find("no number"), std::string::npos);
  EXPECT_EQ(frames_of({"frame-000030.color"}).stamps[0]->ns, 1'000'000'000);
}

TEST(NumbersInNames, NothingIsTakenThatDoesNotRiseStrictly) {
  Rng rng(9);
  for (int round = 0; round < 3000; ++round) {
    std::set<std::string> names;
    const auto count = 1 + rng.below(12);
    const std::string form = std::array{"a%d_%d", "%d.%d", "%d-%d-%d", "x%dy"}[rng.below(4)];
    const int range = std::array{3, 30, 40000, 2000000000}[rng.below(4)];
    const auto digits = [&] {
      return static_cast<int>(rng.below(static_cast<std::uint32_t>(range)));
    };
    for (std::uint32_t i = 0; i < count; ++i) {
      const int third = digits(), second = digits();
      names.insert(text(form.c_str(), digits(), second, third));
    }
    const std::vector<std::string> stems(names.begin(), names.end());
    const auto read = times_of_names(stems);
    if (!read.ok()) continue;
    std::set<std::int64_t> seen;
    for (const auto& stamp : read->stamps)
      if (stamp) {
        EXPECT_TRUE(seen.insert(stamp->ns).second) << stems.front() << " " << read->taken_as;
        EXPECT_GE(stamp->ns, 0);
      }
  }
}

TEST(NameTimes, BytesThatMarkGroupsInsideMayStandInNames) {
  const std::vector<std::string> names{"12-5\1.\1 a/\1.b", "13-5\1.\1 a/\1.b"};
  EXPECT_TRUE(times_of_names(names).ok());
  EXPECT_FALSE(times_of_names(std::vector<std::string>{"\1.\1"}).ok()) << "no digits";
}

}  // namespace
}  // namespace ygslam
