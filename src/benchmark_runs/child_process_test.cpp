#include "benchmark_runs/child_process.hpp"

#include <gtest/gtest.h>

#include <csignal>

#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

ChildExit shell(const std::string& script, const std::filesystem::path& input = {}) {
  const auto done = run_child({"sh", "-c", script}, input);
  EXPECT_TRUE(done.ok());
  return *done;
}

TEST(ChildProcess, TellsExitCodeSignalAndErrors) {
  EXPECT_EQ(shell("exit 7").exit_code, 7);
  EXPECT_EQ(shell("echo lost >&2").errors, "lost\n");
  const ChildExit crashed = shell("kill -SEGV $$");
  EXPECT_EQ(crashed.signal, SIGSEGV);
  EXPECT_EQ(crashed.exit_code, 0);
}

TEST(ChildProcess, AProgramThatIsNotThereSaysSo) {
  const auto done = run_child({"/nonexistent/program"});
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->exit_code, 127);
  EXPECT_EQ(last_error_line(done->errors), "/nonexistent/program: No such file or directory");
}

TEST(ChildProcess, ReadsItsInputAndKeepsNoMoreThanTheEndOfItsErrors) {
  const testing::TempFolder folder;
  testing::write(folder.path() / "in", "hello\n");
  EXPECT_EQ(shell("cat >&2", folder.path() / "in").errors, "hello\n");
  const ChildExit noisy = shell("yes | head -c 1000000 >&2; echo end >&2");
  EXPECT_LE(noisy.errors.size(), std::size_t{128} << 10);
  EXPECT_EQ(last_error_line(noisy.errors), "end");
}

TEST(ChildProcess, IsEndedWhenAskedTo) {
  const auto done = run_child({"sh", "-c", "exec sleep 600"}, {}, [] { return true; });
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->signal, SIGTERM);
}

TEST(ChildProcess, OneThatWillNotEndIsKilled) {
  std::vector<ChildProcess> children;
  auto stubborn =
      ChildProcess::start({"sh", "-c", "trap '' TERM; echo deaf >&2; while :; do sleep 1; done"});
  ASSERT_TRUE(stubborn.ok());
  children.push_back(std::move(*stubborn));
  const pid_t pid = children[0].pid();
  end_all(children, 0.3);
  EXPECT_TRUE(children.empty());
  EXPECT_NE(kill(pid, 0), 0) << "no such process any more";
}

TEST(LastErrorLine, PrefersTheErrorAndIsOneSafeLine) {
  EXPECT_EQ(last_error_line("info: a\nerror: bad file\ninfo: b\n"), "bad file");
  EXPECT_EQ(last_error_line("Traceback\nValueError: no\n"), "ValueError: no");
  EXPECT_EQ(last_error_line("one\ntwo\n"), "two");
  EXPECT_EQ(last_error_line("a\x1b[31m"), "a\\x1b[31m");
  EXPECT_EQ(last_error_line(""), "");
}

}  // namespace
}  // namespace ygslam
