#include "io/atomic_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>

#include "io/ply.hpp"
#include "io/testing/file_size_limit.hpp"
#include "io/testing/ordinary_user.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;
using testing::FileSizeLimit;
using testing::read;
using testing::TempFolder;

std::size_t entries(const fs::path& folder) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator{}));
}

TEST(AtomicFile, ReplacesAnEarlierFileAndLeavesNothingElse) {
  const TempFolder folder("ygslam ausgabe ä");
  const fs::path target = folder.path() / "trajectory.txt";
  ASSERT_TRUE(write_file_atomically(target, "old").ok());
  const std::string large(3'000'000, 'x');
  ASSERT_TRUE(write_file_atomically(target, large).ok());
  EXPECT_EQ(read(target), large);
  EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(AtomicFile, NothingIsSeenOfItUntilItIsFinishedHoweverTheProcessEnds) {
  const TempFolder folder;
  // Where the file system has no files without names it lies there under another one.
  const int probe = ::open(folder.path().c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
  const std::size_t begun = probe < 0 ? 1 : 0;
  if (probe >= 0) ::close(probe);
  auto file = AtomicFile::create(folder.path() / "a.txt");
  ASSERT_TRUE(file.ok());
  ASSERT_TRUE(file->write("begun").ok());
  EXPECT_EQ(entries(folder.path()), begun);
  EXPECT_FALSE(fs::exists(folder.path() / "a.txt"));
  ASSERT_TRUE(file->commit().ok());
  EXPECT_EQ(read(folder.path() / "a.txt"), "begun");
  EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(AtomicFile, NamesMayBeAsLongAsNamesCanBe) {
  const TempFolder folder;
  const fs::path target = folder.path() / std::string(255, 'x');
  ASSERT_TRUE(write_file_atomically(target, "old").ok());
  ASSERT_TRUE(write_file_atomically(target, "new").ok());
  EXPECT_EQ(read(target), "new");
  EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(AtomicFile, WithoutCommitTheEarlierFileStays) {
  const TempFolder folder;
  const fs::path target = folder.path() / "map.ply";
  testing::write(target, "old");
  {
    auto file = AtomicFile::create(target);
    ASSERT_TRUE(file.ok());
    ASSERT_TRUE(file->write("half of the ne").ok());
    EXPECT_EQ(read(target), "old");
    AtomicFile moved = std::move(*file);
    ASSERT_TRUE(moved.write("w").ok());
  }
  EXPECT_EQ(read(target), "old");
  EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(AtomicFile, F26AFullDiskIsAnOutputErrorAndTheEarlierFileIsIntact) {
  const TempFolder folder;
  const fs::path target = folder.path() / "metrics.json";
  testing::write(target, "old");
  {
    const FileSizeLimit full(1000);
    const Status status = write_file_atomically(target, std::string(100'000, 'x'));
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().kind, ErrorKind::kOutput);
    EXPECT_EQ(status.error().message.find(target.string() + ": "), 0U) << status.error().message;
    const std::vector<ColouredPoint> points(1000);
    EXPECT_FALSE(write_ply(target, points).ok());
  }
  EXPECT_EQ(read(target), "old");
  EXPECT_EQ(entries(folder.path()), 1U) << "no half-written file remains";
}

TEST(AtomicFile, F26AReadOnlyFolderIsAnOutputErrorNamingIt) {
  const TempFolder folder;
  const fs::path target = folder.path() / "a.txt";
  testing::write(target, "old");
  fs::permissions(folder.path(), fs::perms::owner_read | fs::perms::owner_exec |
                                     fs::perms::others_read | fs::perms::others_exec);
  {
    const testing::OrdinaryUser user;
    const Status file = write_file_atomically(target, "new");
    const Status directory = ensure_writable_directory(folder.path());
    const Status below = ensure_writable_directory(folder.path() / "sub" / "dir");
    for (const Status* status : {&file, &directory, &below}) {
      ASSERT_FALSE(status->ok());
      EXPECT_EQ(status->error().kind, ErrorKind::kOutput);
      EXPECT_EQ(status->error().message.find(folder.path().string()), 0U);
      EXPECT_NE(status->error().message.find("denied"), std::string::npos);
    }
  }
  fs::permissions(folder.path(), fs::perms::owner_all);
  EXPECT_EQ(read(target), "old");
}

TEST(AtomicFile, F26AFileOrFolderInTheWayIsAnOutputError) {
  const TempFolder folder;
  testing::write(folder.path() / "file", "x");
  fs::create_directory(folder.path() / "folder");
  EXPECT_FALSE(ensure_writable_directory(folder.path() / "file").ok());
  EXPECT_FALSE(ensure_writable_directory(folder.path() / "file" / "below").ok());
  EXPECT_FALSE(write_file_atomically(folder.path() / "folder", "x").ok());
  EXPECT_FALSE(write_file_atomically(folder.path() / "none" / "x", "x").ok());
  EXPECT_EQ(read(folder.path() / "file"), "x");
}

TEST(AtomicFile, F31ASymbolicLinkIsReplacedNotFollowed) {
  const TempFolder folder;
  testing::write(folder.path() / "precious", "precious");
  fs::create_symlink(folder.path() / "precious", folder.path() / "out.txt");
  ASSERT_TRUE(write_file_atomically(folder.path() / "out.txt", "new").ok());
  EXPECT_EQ(read(folder.path() / "precious"), "precious");
  EXPECT_EQ(read(folder.path() / "out.txt"), "new");
  EXPECT_FALSE(fs::is_symlink(folder.path() / "out.txt"));
}

TEST(AtomicFile, ALinkToWhatIsNoFileIsLeftAsItIs) {
  const TempFolder folder;
  fs::create_symlink("/dev/null", folder.path() / "link");
  for (const fs::path& target :
       {folder.path() / "link", fs::path("/dev/stdout"), fs::path("/dev/fd/1"),
        fs::path("/proc/self/fd/1"), fs::path("/dev/none")}) {
    const Status status = write_file_atomically(target, "x");
    ASSERT_FALSE(status.ok()) << target;
    EXPECT_EQ(status.error().message, target.string() + ": is not a regular file");
  }
  EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
  EXPECT_TRUE(fs::is_symlink("/dev/stdout"));
}

TEST(EnsureWritableDirectory, CreatesParentsAndLeavesNoTrace) {
  const TempFolder folder;
  const fs::path out = folder.path() / "a b" / "ü";
  ASSERT_TRUE(ensure_writable_directory(out).ok());
  ASSERT_TRUE(ensure_writable_directory(out).ok());
  EXPECT_EQ(entries(out), 0U);
}

TEST(OutputLock, F29ASecondHolderIsRefusedUntilTheFirstIsGone) {
  const TempFolder folder;
  {
    auto first = OutputLock::acquire(folder.path());
    ASSERT_TRUE(first.ok());
    const auto second = OutputLock::acquire(folder.path());
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(second.error().kind, ErrorKind::kOutput);
    EXPECT_NE(second.error().message.find("locked"), std::string::npos);
    const OutputLock moved = std::move(*first);
    EXPECT_FALSE(OutputLock::acquire(folder.path()).ok());
  }
  EXPECT_TRUE(OutputLock::acquire(folder.path()).ok());
}

TEST(OutputLock, F29ASecondProcessIsRefused) {
  const TempFolder folder;
  const auto lock = OutputLock::acquire(folder.path());
  ASSERT_TRUE(lock.ok());
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) ::_exit(OutputLock::acquire(folder.path()).ok() ? 1 : 0);
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(OutputLock, F29AMissingFolderIsAnOutputError) {
  const auto lock = OutputLock::acquire("/nonexistent/folder");
  ASSERT_FALSE(lock.ok());
  EXPECT_EQ(lock.error().kind, ErrorKind::kOutput);
}

}  // namespace
}  // namespace ygslam
