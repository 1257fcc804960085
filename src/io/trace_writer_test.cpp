// A trace is JSON that says which thread did what; a thread never waits for the file.
#include "io/trace_writer.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "core/bounded_queue.hpp"
#include "io/testing/file_size_limit.hpp"
#include "io/testing/ordinary_user.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

using nlohmann::json;
using testing::read;
using testing::TempFolder;

class TraceWriterTest : public ::testing::Test {
 protected:
  json finished() {
    const Status done = writer_.finish();
    EXPECT_TRUE(done.ok());
    return json::parse(read(file_));
  }
  static std::vector<json> of_phase(const json& events, const std::string& phase) {
    std::vector<json> found;
    for (const json& event : events)
      if (event["ph"] == phase) found.push_back(event);
    return found;
  }
  static int thread_named(const json& events, const std::string& name) {
    for (const json& event : events)
      if (event["name"] == "thread_name" && event["args"]["name"] == name) return event["tid"];
    return 0;
  }

  TempFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "trace.json";
  TraceWriter writer_{64};
};

TEST_F(TraceWriterTest, TellsWhatTwoThreadsDid) {
  ASSERT_TRUE(writer_.start(file_).ok());
  {
    const trace::ScopedTracer traced(writer_.tracer());
    trace::name_thread("one \"quoted\" \\ \n name");
    WorkerThread other([](const std::stop_token&) {
      trace::name_thread("the other");
      const trace::Span span("inner", FrameId{7});
    });
    const trace::Span outer("outer", FrameId{3});
    const trace::Span inner("within\t");
    other.join();
  }
  const json events = finished();
  const int one = thread_named(events, "one \"quoted\" \\ \n name");
  const int other = thread_named(events, "the other");
  EXPECT_GT(one, 0);
  EXPECT_GT(other, 0);
  EXPECT_NE(one, other);
  const auto spans = of_phase(events, "X");
  ASSERT_EQ(spans.size(), 3U);
  for (const json& span : spans) {
    EXPECT_EQ(span["tid"], span["name"] == "inner" ? other : one);
    EXPECT_EQ(span["args"]["frame"], span["name"] == "inner" ? 7 : 3) << "or that of the outer one";
    EXPECT_EQ(span["cat"], "stage");
    EXPECT_GE(span["args"]["cpu_ms"], 0);
  }
}

TEST_F(TraceWriterTest, TellsOfQueues) {
  BoundedQueue<int> newest(1, Overflow::kDropOldest, "newest");
  ASSERT_TRUE(writer_.start(file_).ok());
  {
    const trace::ScopedTracer traced(writer_.tracer());
    trace::name_thread("tracking");
    for (int i = 0; i < 3; ++i) newest.push(i);
    newest.try_pop();
    static_cast<void>(newest.pop_until(std::chrono::steady_clock::now()));
  }
  const json events = finished();
  const auto waits = of_phase(events, "X");
  ASSERT_EQ(waits.size(), 1U);
  EXPECT_EQ(waits[0]["cat"], "wait");
  EXPECT_EQ(waits[0]["name"], "queue is empty: newest");
  std::vector<int> lengths;
  for (const json& length : of_phase(events, "C")) {
    EXPECT_EQ(length["name"], "queue: newest");
    lengths.push_back(length["args"]["length"]);
  }
  EXPECT_EQ(lengths, (std::vector{1, 1, 1, 0}));
  const auto dropped = of_phase(events, "i");
  ASSERT_EQ(dropped.size(), 2U);
  EXPECT_EQ(dropped[0]["name"], "dropped: newest");
}

TEST_F(TraceWriterTest, AFullBufferLosesEventsAndNobodyWaits) {
  {
    const trace::ScopedTracer traced(writer_.tracer());  // nobody writes yet
    trace::name_thread("fast");
    for (int i = 0; i < 100; ++i) const trace::Span span("stage");
  }
  EXPECT_EQ(writer_.dropped(), 36U);
  ASSERT_TRUE(writer_.start(file_).ok());
  EXPECT_EQ(of_phase(finished(), "X").size(), 64U);
}

TEST_F(TraceWriterTest, AThreadThatEndedLeavesItsTrackToTheNextOfItsName) {
  ASSERT_TRUE(writer_.start(file_).ok());
  {
    const trace::ScopedTracer traced(writer_.tracer());
    for (int i = 0; i < 20; ++i) {
      WorkerThread thread([](const std::stop_token&) {
        trace::name_thread("adjustment");
        const trace::Span span("adjust");
      });
      thread.join();
    }
  }
  const json events = finished();
  std::set<int> threads;
  for (const json& span : of_phase(events, "X")) threads.insert(span["tid"].get<int>());
  EXPECT_EQ(of_phase(events, "X").size(), 20U);
  EXPECT_EQ(threads.size(), 1U);
}

TEST_F(TraceWriterTest, IsReadableAtAnyTimeButForTheBracket) {
  ASSERT_TRUE(writer_.start(file_).ok());
  const trace::ScopedTracer traced(writer_.tracer());
  trace::name_thread("tracking");
  for (int i = 0; i < 10; ++i) const trace::Span span("stage");
  std::string text;
  for (int tries = 0; tries < 1000 && text.find("stage\",\"cat") == std::string::npos; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    text = read(file_);
  }
  EXPECT_EQ(of_phase(json::parse(text + "]"), "X").size(), 10U);
}

TEST_F(TraceWriterTest, ReplacesTracesOnly) {
  ASSERT_TRUE(writer_.start(file_).ok());
  ASSERT_TRUE(writer_.finish().ok());
  EXPECT_TRUE(TraceWriter::check(file_).ok());
  const auto other = folder_.path() / "metrics.json";
  ASSERT_TRUE(std::ofstream(other) << "[1, 2]");
  const Status refused = TraceWriter::check(other);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::kOutput);
  EXPECT_TRUE(refused.error().message.find("is there and no trace") != std::string::npos);
  EXPECT_FALSE(TraceWriter::check(folder_.path() / "nowhere" / "trace.json").ok());
  EXPECT_FALSE(TraceWriter::check("-").ok());
}

TEST_F(TraceWriterTest, WhatCannotBeReadIsNotReplaced) {
  namespace fs = std::filesystem;
  testing::write(file_, "somebody's");
  fs::permissions(file_, fs::perms::owner_write);
  testing::OrdinaryUser::give(file_.c_str());
  testing::OrdinaryUser::give(folder_.path().c_str());
  {
    const testing::OrdinaryUser user;
    for (const Status& refused : {TraceWriter::check(file_), writer_.start(file_)}) {
      ASSERT_FALSE(refused.ok());
      EXPECT_EQ(refused.error().kind, ErrorKind::kOutput);
      EXPECT_NE(refused.error().message.find("cannot be read"), std::string::npos);
    }
    fs::permissions(file_, fs::perms::owner_all);
  }
  EXPECT_EQ(read(file_), "somebody's");
}

TEST_F(TraceWriterTest, AFullDiskIsTold) {
  ASSERT_TRUE(writer_.start(file_).ok());
  const testing::FileSizeLimit limit(100);
  const trace::ScopedTracer traced(writer_.tracer());
  trace::name_thread("tracking");
  { const trace::Span span("stage"); }
  const Status done = writer_.finish();
  ASSERT_FALSE(done.ok());
  EXPECT_TRUE(done.error().message.starts_with(file_.string()));
}

}  // namespace
}  // namespace ygslam
