#include "io/piece_file.hpp"

#include <gtest/gtest.h>

#include "io/testing/file_size_limit.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

TEST(PieceFile, HoldsWhatWasAddedInOrder) {
  const testing::TempFolder folder;
  auto file = PieceFile::create(folder.path() / "a");
  ASSERT_TRUE(file.ok());
  std::string expected;
  for (std::uint32_t i = 0; i < 700'000; ++i) {
    file->add_value(i);
    expected.append(reinterpret_cast<const char*>(&i), 4);
  }
  EXPECT_EQ(file->size(), expected.size());
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a")) << "not before commit";
  ASSERT_TRUE(file->commit().ok());
  EXPECT_EQ(testing::read(folder.path() / "a"), expected);
}

TEST(PieceFile, F26TheFirstFailureIsToldAtTheEnd) {
  const testing::TempFolder folder;
  const auto path = folder.path() / "a";
  testing::write(path, "old");
  const testing::FileSizeLimit full(3 << 20);
  auto file = PieceFile::create(path);
  ASSERT_TRUE(file.ok());
  for (int i = 0; i < 5; ++i) file->add(std::string(1 << 20, 'x'));
  const Status status = file->commit();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::kOutput);
  EXPECT_EQ(status.error().message.find(path.string() + ": "), 0U);
  EXPECT_EQ(testing::read(path), "old");
}

}  // namespace
}  // namespace ygslam
