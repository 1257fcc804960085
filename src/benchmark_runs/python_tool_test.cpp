#include "benchmark_runs/python_tool.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

// The environment without what a developer may have set.
class PythonTools : public ::testing::Test {
 protected:
  PythonTools() {
    unsetenv("YGSLAM_REPORT");
    unsetenv("YGSLAM_PYTHON");
  }
  ~PythonTools() override {
    unsetenv("YGSLAM_REPORT");
    unsetenv("YGSLAM_PYTHON");
  }
  testing::TempFolder folder_;
  fs::path root_ = folder_.path();
};

TEST_F(PythonTools, AreFoundInTheSourceTreeWithItsInterpreter) {
  testing::write(root_ / "tools/report/__main__.py", "");
  testing::write(root_ / ".venv/bin/python", "");
  const auto tool = find_report_tool(root_ / "build/release/ygslam");
  ASSERT_TRUE(tool.ok());
  EXPECT_EQ(tool->script, root_ / "tools/report");
  EXPECT_EQ(tool->python, root_ / ".venv/bin/python");
  EXPECT_FALSE(find_report_tool(root_ / "build/release/ygslam", "other.py").ok());
}

TEST_F(PythonTools, AreFoundInAnInstallation) {
  testing::write(root_ / "share/ygslam/report/eval_plot.py", "");
  const auto tool = find_report_tool(root_ / "bin/ygslam", "eval_plot.py");
  ASSERT_TRUE(tool.ok());
  EXPECT_EQ(tool->script, root_ / "share/ygslam/report/eval_plot.py");
  EXPECT_EQ(tool->python, "python3");
}

TEST_F(PythonTools, MayBeGivenByTheEnvironment) {
  testing::write(root_ / "mine/__main__.py", "");
  setenv("YGSLAM_REPORT", (root_ / "mine").c_str(), 1);
  setenv("YGSLAM_PYTHON", "/opt/python", 1);
  const auto tool = find_report_tool("/nowhere/ygslam");
  ASSERT_TRUE(tool.ok());
  EXPECT_EQ(tool->script, root_ / "mine");
  EXPECT_EQ(tool->python, "/opt/python");
  setenv("YGSLAM_REPORT", "/nonexistent", 1);
  const auto missing = find_report_tool("/nowhere/ygslam");
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().message.find("/nonexistent/__main__.py"), std::string::npos);
}

TEST_F(PythonTools, SayInOneLineWhyTheyFail) {
  const auto tool = [&](const std::string& script) {
    testing::write(root_ / "python", script);
    fs::permissions(root_ / "python", fs::perms::owner_all);
    return run_tool({root_ / "python", "x"}, {"--results", "r"}, "the report");
  };
  EXPECT_TRUE(tool("#!/bin/sh\n[ \"$*\" = '-B x --results r' ]\n").ok());
  const Status failed = tool("#!/bin/sh\necho 'KeyError: ate' >&2; exit 1\n");
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().kind, ErrorKind::kOutput);
  EXPECT_EQ(failed.error().message, "the report cannot be made: KeyError: ate");
  EXPECT_EQ(tool("#!/bin/sh\nkill -KILL $$\n").error().message,
            "the report cannot be made: ended by signal 9");
  EXPECT_NE(tool("#!/bin/sh\necho \"No module named 'numpy'\" >&2; exit 1\n")
                .error()
                .message.find("make setup"),
            std::string::npos);
  setenv("YGSLAM_REPORT", "x", 1);
  setenv("YGSLAM_PYTHON", "y", 1);
  EXPECT_NE(tool("#!/bin/sh\necho \"No module named 'numpy'\" >&2; exit 1\n")
                .error()
                .message.find("/python -m pip install \"ygslam[report]\" installs"),
            std::string::npos);
}

}  // namespace
}  // namespace ygslam
