#include "core/file_view.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <numeric>
#include <string>

#include "core/testing/memory_limit.hpp"

namespace ygslam {
namespace {

class FileViewTest : public ::testing::Test {
 protected:
  FileViewTest()
      : file_(std::filesystem::temp_directory_path() /
              ("ygslam_view_" + std::to_string(getpid()))) {}
  ~FileViewTest() override { std::filesystem::remove(file_); }
  void write(const std::string& bytes) const { std::ofstream(file_, std::ios::binary) << bytes; }

  std::filesystem::path file_;
};

/// Pages of files that this process holds [kB].
long file_pages_kb() {
  long size = 0;
  long resident = 0;
  long shared = 0;
  std::ifstream("/proc/self/statm") >> size >> resident >> shared;
  return shared * sysconf(_SC_PAGESIZE) / 1024;
}

TEST_F(FileViewTest, ShowsTheBytesAndGivesTheirPagesBack) {
  if (testing::is_emulated()) GTEST_SKIP() << "QEMU has pages of its own";
  constexpr long kSize_kb = 16 << 10;
  std::string bytes(std::size_t{kSize_kb} << 10, '\0');
  std::iota(bytes.begin(), bytes.end(), '\1');
  write(bytes);
  const auto view = FileView::open(file_);
  ASSERT_NE(view, nullptr);
  const long before_kb = file_pages_kb();
  EXPECT_TRUE(view->bytes() == bytes);
  EXPECT_GT(file_pages_kb(), before_kb + kSize_kb * 3 / 4);
  view->give_back();
  EXPECT_LT(file_pages_kb(), before_kb + kSize_kb / 4);
  EXPECT_TRUE(view->bytes() == bytes) << "they are brought again";
}

TEST_F(FileViewTest, IsNoneWhereThereIsNothingToSee) {
  EXPECT_EQ(FileView::open(file_), nullptr) << "no file";
  EXPECT_EQ(FileView::open(file_.parent_path()), nullptr) << "a folder";
  write("");
  EXPECT_EQ(FileView::open(file_), nullptr) << "empty";
  write("x");
  ASSERT_NE(FileView::open(file_), nullptr);
  EXPECT_EQ(FileView::open(file_)->bytes(), "x");
}

}  // namespace
}  // namespace ygslam
