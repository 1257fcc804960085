// What the engine's tool says of a run; the engine itself: tests/bench_engine_test.py.
#include "benchmark_runs/dask_engine.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

ChildExit handing(const std::string& errors, int exit_code = 0) {
  ChildExit exit;
  exit.exit_code = exit_code;
  exit.errors = errors;
  return exit;
}

TEST(DaskEngine, ARunEndsHereAsItEndedThere) {
  const auto exit = exit_on_worker(
      handing("a library's word\n{\"exit_code\": 0, \"signal\": 15, \"wall_s\": 2.5, "
              "\"timed_out\": true, \"errors\": \"warning: late\\n\"}\n"));
  ASSERT_TRUE(exit.ok()) << exit.error().message;
  EXPECT_EQ(exit->signal, 15);
  EXPECT_EQ(exit->wall_s, 2.5);
  EXPECT_TRUE(exit->timed_out);
  EXPECT_EQ(exit->errors, "warning: late\n");
}

TEST(DaskEngine, ItsOwnFaultsAreNoRunsFaults) {
  for (const ChildExit& fault :
       {handing("error: no Dask scheduler at head:1\n", 9), handing(""), handing("{"),
        handing("[]"), handing("{\"exit_code\": \"0\"}"), handing("{\"exit_code\": 0}")}) {
    const auto exit = exit_on_worker(fault);
    ASSERT_FALSE(exit.ok()) << fault.errors;
    EXPECT_EQ(exit.error().kind, ErrorKind::kOutput);
    EXPECT_TRUE(exit.error().message.starts_with("the engine cannot be used: "))
        << exit.error().message;
  }
  const auto lacking = exit_on_worker(handing("error: No module named 'distributed'\n", 9));
  EXPECT_NE(lacking.error().message.find("pip install distributed"), std::string::npos);
}

}  // namespace
}  // namespace ygslam
