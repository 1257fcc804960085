#include "io/frame_reader.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>

#include "core/log.hpp"
#include "io/testing/small_sequence.hpp"
#include "io/tum_sequence.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;
using testing::SmallSequence;
using testing::TempFolder;

// Collects what is logged while it lives.
class LogCapture {
 public:
  [[nodiscard]] std::size_t lines_with(const std::string& what) const {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(std::count_if(
        lines_.begin(), lines_.end(),
        [&](const std::string& line) { return line.find(what) != std::string::npos; }));
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
  const log::ScopedSink scope_{
      std::make_shared<const log::Sink>([this](log::Level, const std::string& line) {
        const std::lock_guard lock(mutex_);
        lines_.push_back(line);
      })};
};

std::vector<std::uint32_t> ids_of_rest(FrameReader& reader) {
  std::vector<std::uint32_t> ids;
  while (const auto frame = reader.next()) ids.push_back(index((*frame)->id));
  return ids;
}

Sequence open(const fs::path& root) { return *open_tum_sequence(root); }

TEST(FrameReader, WhoHearsOfABadImageMayAskForTheCounts) {
  const TempFolder folder;
  const SmallSequence small{.count = 8};
  small.write_to(folder.path());
  testing::write(folder.path() / small.colour_file(5), "no image");
  std::optional<FrameReader> reader;
  std::atomic<std::size_t> heard = 0;
  const log::ScopedSink scope(std::make_shared<const log::Sink>(
      [&](log::Level, const std::string&) { heard += reader->counts().skipped_images; }));
  FrameReaderConfig config;
  config.ahead = 1;  // the bad one is read when the reader is there
  reader.emplace(open(folder.path()), config);
  while (reader->next()) {
  }
  EXPECT_EQ(heard, 1U);
}

TEST(FrameReader, YieldsAllFramesInOrder) {
  const TempFolder folder;
  SmallSequence{.count = 12, .jpeg = true}.write_to(folder.path());
  FrameReader reader(open(folder.path()), {});
  std::uint32_t expected = 0;
  while (const auto frame = reader.next()) {
    EXPECT_EQ((*frame)->id, FrameId{expected});
    EXPECT_EQ((*frame)->stamp, reader.sequence().pairs[expected].stamp);
    ++expected;
  }
  EXPECT_EQ(expected, 12U);
  EXPECT_EQ(reader.counts().readable, 12U);
  EXPECT_EQ(reader.counts().offered, 12U);
  EXPECT_FALSE(reader.next().has_value()) << "the end stays the end";
}

TEST(FrameReader, FromToAndStrideSelectWhatIsOffered) {
  const TempFolder folder;
  SmallSequence{.count = 12}.write_to(folder.path());
  const Sequence sequence = open(folder.path());
  for (std::size_t from : {0, 3, 11, 12, 100}) {
    for (std::size_t to : {0, 5, 12, 100}) {
      for (std::size_t stride : {1, 2, 5, 100}) {
        std::vector<Timestamp> expected;
        for (std::size_t i = from; i < std::min<std::size_t>(to, 12); i += stride) {
          expected.push_back(sequence.pairs[i].stamp);
        }
        FrameReader reader(sequence, {.from = from, .to = to, .stride = stride});
        std::vector<Timestamp> found;
        while (const auto frame = reader.next()) {
          EXPECT_EQ(index((*frame)->id), found.size());
          found.push_back((*frame)->stamp);
        }
        EXPECT_EQ(found, expected) << from << " " << to << " " << stride;
        EXPECT_EQ(reader.counts().offered, expected.size());
      }
    }
  }
}

TEST(FrameReader, F1MissingColourImagesInARowAreSkippedAndCounted) {
  for (const int gone : {1, 5, 30}) {
    const TempFolder folder;
    const SmallSequence small{.count = 36};
    small.write_to(folder.path());
    for (int i = 3; i < 3 + gone; ++i) fs::remove(folder.path() / small.colour_file(i));
    const LogCapture log;
    FrameReader reader(open(folder.path()), {});
    const auto ids = ids_of_rest(reader);
    EXPECT_EQ(ids.size(), 36U - gone);
    EXPECT_EQ(ids[3], 3U + gone) << "ids count the pairs offered";
    const FrameReaderCounts counts = reader.counts();
    EXPECT_EQ(counts.skipped.size(), static_cast<std::size_t>(gone));
    EXPECT_EQ(counts.skipped.front().file, small.colour_file(3));
    EXPECT_EQ(counts.skipped.front().reason, "no such file");
    EXPECT_EQ(counts.readable, 36U - gone);
    EXPECT_EQ(counts.bursts, 1U);
    EXPECT_EQ(log.lines_with("no such file"), 1U) << "one warning per burst";
  }
}

TEST(FrameReader, OfManyUnusableImagesTheFirstAreListedAndAllCounted) {
  const TempFolder folder;
  const SmallSequence small{.count = 1200,
                            .width = 2,
                            .height = 2,
                            .associations = true,
                            .calibration = "fx 2\nfy 2\ncx 1\ncy 1\n"};
  small.write_to(folder.path());
  auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  sequence->absent.push_back({"depth/none.png", "no such file"});
  for (int i = 5; i < 1200; ++i) fs::remove(folder.path() / small.colour_file(i));
  FrameReader reader(std::move(*sequence), {});
  std::size_t readable = 0;
  while (reader.next()) ++readable;
  EXPECT_EQ(readable, 5U);
  EXPECT_EQ(reader.counts().skipped_images, 1196U);
  EXPECT_EQ(reader.counts().skipped.size(), kMostSkippedTold);
  EXPECT_EQ(reader.counts().skipped.front().file, "depth/none.png");
}

TEST(FrameReader, F1AnUnreadableFileIsSkippedLikeAMissingOne) {
  const TempFolder folder;
  const SmallSequence small{.count = 5};
  small.write_to(folder.path());
  fs::remove(folder.path() / small.depth_file(1));
  fs::create_directory(folder.path() / small.depth_file(1));  // a folder where a file should be
  FrameReader reader(open(folder.path()), {});
  EXPECT_EQ(ids_of_rest(reader), (std::vector<std::uint32_t>{0, 2, 3, 4}));
}

TEST(FrameReader, F2TruncatedImagesAreSkippedWithOneWarningPerBurst) {
  const TempFolder folder;
  const SmallSequence small{.count = 12, .jpeg = true};
  small.write_to(folder.path());
  const auto truncate = [&](const std::string& file) {
    const std::string bytes = testing::read(folder.path() / file);
    testing::write(folder.path() / file, bytes.substr(0, bytes.size() * 6 / 10));
  };
  for (const int i : {2, 3, 4}) truncate(small.colour_file(i));
  truncate(small.depth_file(4));
  truncate(small.depth_file(9));
  const LogCapture log;
  FrameReader reader(open(folder.path()), {});
  EXPECT_EQ(ids_of_rest(reader), (std::vector<std::uint32_t>{0, 1, 5, 6, 7, 8, 10, 11}));
  EXPECT_EQ(reader.counts().skipped.size(), 5U) << "files, both of pair 4";
  EXPECT_EQ(reader.counts().bursts, 2U);
  EXPECT_EQ(log.lines_with("skipping"), 2U);
}

TEST(FrameReader, F3AnImageOfAnotherKindMidRunIsRefusedWithTheReason) {
  const TempFolder folder;
  const SmallSequence small{.count = 8};
  small.write_to(folder.path());
  Rng rng(1);
  const auto put = [&](const std::string& file, const std::string& bytes) {
    testing::write(folder.path() / file, bytes);
  };
  put(small.colour_file(1), encode_png(testing::random_colour(16, 12, rng)));
  put(small.colour_file(2), encode_png(testing::random_grey<std::uint8_t>(32, 24, rng)));
  put(small.depth_file(3), encode_png(testing::random_grey<std::uint8_t>(32, 24, rng)));
  put(small.depth_file(4), encode_png(testing::random_grey<std::uint16_t>(64, 24, rng)));
  put(small.depth_file(5), encode_png(testing::random_colour(32, 24, rng)));
  FrameReader reader(open(folder.path()), {});
  EXPECT_EQ(ids_of_rest(reader), (std::vector<std::uint32_t>{0, 6, 7}));
  const auto skipped = reader.counts().skipped;
  ASSERT_EQ(skipped.size(), 5U);
  EXPECT_EQ(skipped[0].reason, "other size: 16x12, expected 32x24");
  for (const std::size_t i : {1U, 2U, 4U}) {
    EXPECT_NE(skipped[i].reason.find("other format"), std::string::npos) << skipped[i].reason;
  }
  EXPECT_NE(skipped[3].reason.find("other size"), std::string::npos);
}

TEST(FrameReader, GreyRecordingsAreReadAsGrey) {
  const TempFolder folder;
  const SmallSequence small{.count = 3};
  small.write_to(folder.path());
  Rng rng(1);
  for (int i = 0; i < 3; ++i) {
    testing::write(folder.path() / small.colour_file(i),
                   encode_png(testing::random_grey<std::uint8_t>(32, 24, rng)));
  }
  FrameReader reader(open(folder.path()), {});
  EXPECT_EQ(ids_of_rest(reader).size(), 3U);
}

TEST(FrameReader, FileSpeedNeverDrops) {
  const TempFolder folder;
  SmallSequence{.count = 20}.write_to(folder.path());
  FrameReader reader(open(folder.path()), {.ahead = 1});
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // one is decoded ahead, waiting
  EXPECT_EQ(reader.counts().readable, 0U) << "nobody has had one";
  EXPECT_EQ(ids_of_rest(reader).size(), 20U);
  EXPECT_EQ(reader.counts().readable, 20U);
  EXPECT_EQ(reader.counts().dropped, 0U);
}

TEST(FrameReader, RealtimeDropsTheOldestWaitingFramesAndCountsThem) {
  const TempFolder folder;
  SmallSequence{.count = 12, .interval_ns = 100'000}.write_to(folder.path());
  FrameReader reader(open(folder.path()), {.realtime = true, .realtime_waiting = 2});
  const auto first = reader.next();
  ASSERT_TRUE(first.has_value());
  // A consumer that is late: all but what may wait must have gone.
  while (reader.counts().dropped < 9) std::this_thread::yield();
  std::vector<std::uint32_t> ids = {index((*first)->id)};
  const auto rest = ids_of_rest(reader);
  ids.insert(ids.end(), rest.begin(), rest.end());
  EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
  EXPECT_EQ(ids.back(), 11U) << "the newest is never the one dropped";
  EXPECT_EQ(ids.size() + reader.counts().dropped, 12U);
  EXPECT_EQ(reader.counts().readable, 12U);
}

TEST(FrameReader, EveryPairOfferedIsHandedOut) {
  for (const bool realtime : {false, true}) {
    const TempFolder folder;
    const SmallSequence small{.count = 12, .interval_ns = 100'000};
    small.write_to(folder.path());
    const Sequence sequence = open(folder.path());
    for (const int i : {0, 5, 6, 11}) fs::remove(folder.path() / small.colour_file(i));
    FrameReader reader(sequence, {.realtime = realtime});
    std::vector<std::uint32_t> ids, unreadable;
    std::size_t dropped = 0;
    while (const auto offered = reader.next_offered()) {
      ids.push_back(index(offered->id));
      EXPECT_EQ(offered->stamp, sequence.pairs[ids.back()].stamp);
      EXPECT_TRUE(!offered->frame || offered->frame->id == offered->id);
      if (offered->is_dropped) ++dropped;
      if (!offered->frame && !offered->is_dropped) unreadable.push_back(ids.back());
      // A consumer that is late.
      if (realtime && offered->frame)
        while (reader.counts().dropped < 5) std::this_thread::yield();
    }
    EXPECT_EQ(ids, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
    EXPECT_EQ(unreadable, (std::vector<std::uint32_t>{0, 5, 6, 11}));
    EXPECT_EQ(dropped, reader.counts().dropped);
    EXPECT_EQ(reader.counts().readable, 8U);
  }
}

TEST(FrameReader, WhatIsDroppedInAPauseIsMarked) {
  FrameQueue queue(1, FrameQueue::When::kFullDrops);
  const auto frame = std::make_shared<const RgbdFrame>();
  EXPECT_TRUE(queue.push({FrameId{0}, {}, frame}));
  EXPECT_TRUE(queue.push({FrameId{1}, {}, frame}, true));
  EXPECT_TRUE(queue.push({FrameId{2}, {}, frame}, false));
  EXPECT_TRUE(queue.pop({})->while_paused);
  const auto late = queue.pop({});
  EXPECT_TRUE(late->is_dropped && !late->while_paused && !late->frame);
  EXPECT_TRUE(queue.pop({})->frame);
  EXPECT_EQ(queue.dropped(), 2U);
}

TEST(FrameReader, WarningsOfManyBurstsAreFew) {
  const TempFolder folder;
  const SmallSequence small{.count = 230,
                            .width = 2,
                            .height = 2,
                            .associations = true,
                            .calibration = "fx 2\nfy 2\ncx 1\ncy 1\n"};
  small.write_to(folder.path());
  for (int i = 1; i < 230; i += 2) fs::remove(folder.path() / small.colour_file(i));
  const LogCapture log;
  FrameReader reader(open(folder.path()), {});
  EXPECT_EQ(ids_of_rest(reader).size(), 115U);
  EXPECT_EQ(reader.counts().bursts, 115U);
  EXPECT_EQ(log.lines_with("skipping"), 11U) << "the first ten and the 100th";
}

TEST(FrameReader, NoFrameOfRealtimeIsLateForAPause) {
  const TempFolder folder;
  SmallSequence{.count = 12, .interval_ns = 10'000'000}.write_to(folder.path());
  FrameReader reader(open(folder.path()), {.realtime = true, .realtime_waiting = 2});
  ASSERT_TRUE(reader.next().has_value());
  reader.pause();
  reader.pause();
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() < begin + std::chrono::milliseconds(300))
    std::this_thread::yield();  // all frames would have gone by
  EXPECT_EQ(reader.counts().dropped, 0U);
  reader.resume();
  EXPECT_GE(ids_of_rest(reader).size(), 2U) << "it goes on";
  reader.resume();
}

TEST(FrameReader, WhoAsksInAPauseGetsOneFrameAfterTheOther) {
  const TempFolder folder;
  SmallSequence{.count = 12, .interval_ns = 10'000'000}.write_to(folder.path());
  FrameReader reader(open(folder.path()), {.realtime = true, .realtime_waiting = 1});
  ASSERT_TRUE(reader.next().has_value());
  reader.pause();
  std::uint32_t last = 0;
  std::size_t before = 0;  // dropped: a busy machine may be late with the pause
  for (int step = 0; step < 5; ++step) {
    const auto begin = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() < begin + std::chrono::milliseconds(25))
      std::this_thread::yield();  // a consumer that is slow
    const auto frame = reader.next();
    ASSERT_TRUE(frame.has_value());
    if (step > 0) {
      EXPECT_EQ(index((*frame)->id), last + 1);
    } else {
      before = reader.counts().dropped;
    }
    last = index((*frame)->id);
  }
  EXPECT_EQ(reader.counts().dropped, before);
  reader.resume();
  EXPECT_EQ(ids_of_rest(reader).back(), 11U) << "it goes on";
}

TEST(FrameReader, StopsWhilePaused) {
  const TempFolder folder;
  SmallSequence{.count = 3, .interval_ns = 10'000'000}.write_to(folder.path());
  FrameReader reader(open(folder.path()), {.realtime = true});
  ASSERT_TRUE(reader.next().has_value());
  reader.pause();
}

TEST(FrameReader, RealtimeGivesNoFrameBeforeItsStamp) {
  const TempFolder folder;
  SmallSequence{.count = 8, .interval_ns = 5'000'000}.write_to(folder.path());
  FrameReader reader(open(folder.path()), {.realtime = true, .realtime_waiting = 8});
  const auto start = std::chrono::steady_clock::now();
  while (const auto frame = reader.next()) {
    const auto elapsed = std::chrono::steady_clock::now() - start;
    EXPECT_GE(elapsed, std::chrono::nanoseconds(index((*frame)->id) * std::int64_t{5'000'000}));
  }
  EXPECT_EQ(reader.counts().dropped, 0U);
}

TEST(FrameReader, RealtimeCutsALongGap) {
  const TempFolder folder;  // an hour between frames would hang the test
  SmallSequence{.count = 3, .interval_ns = 3'600'000'000'000}.write_to(folder.path());
  FrameReader reader(open(folder.path()), {.realtime = true, .longest_gap_s = 0.001});
  EXPECT_GE(ids_of_rest(reader).size(), 2U);
}

TEST(FrameReader, StopsWhereverItIs) {
  const TempFolder folder;
  SmallSequence{.count = 6, .interval_ns = 3'600'000'000'000}.write_to(folder.path());
  const Sequence sequence = open(folder.path());
  for (int round = 0; round < 60; ++round) {
    {
      const FrameReader never_asked(sequence, {.ahead = 1, .realtime = round % 2 == 0});
    }
    // Waiting for a stamp that is an hour away.
    FrameReader waiting(sequence, {.realtime = true, .longest_gap_s = 1e6});
    EXPECT_TRUE(waiting.next().has_value());
    std::jthread consumer([&] { EXPECT_FALSE(waiting.next().has_value()); });
    waiting.stop();
  }
}

TEST(FrameReader, TheConsumersStopTokenEndsItsWait) {
  const TempFolder folder;
  SmallSequence{.count = 2, .interval_ns = 3'600'000'000'000}.write_to(folder.path());
  FrameReader reader(open(folder.path()), {.realtime = true, .longest_gap_s = 1e6});
  EXPECT_TRUE(reader.next().has_value());
  std::stop_source source;
  std::jthread consumer([&] { EXPECT_FALSE(reader.next(source.get_token()).has_value()); });
  source.request_stop();
}

}  // namespace
}  // namespace ygslam
