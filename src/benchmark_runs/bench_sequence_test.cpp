#include "benchmark_runs/bench_sequence.hpp"

#include <gtest/gtest.h>

#include "io/testing/small_sequence.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;
using testing::TempFolder;

std::vector<std::string> names_in(const fs::path& root) {
  std::vector<std::string> names;
  const auto found = find_sequences(root);
  if (!found.ok()) return names;
  for (const BenchSequence& sequence : *found) names.push_back(sequence.name);
  return names;
}

BenchSequence inspected(const fs::path& folder) {
  BenchSequence sequence = find_sequences(folder)->front();
  inspect_sequence(sequence);
  return sequence;
}

TEST(PaperRow, IsFoundInWholeAndShortenedNames) {
  EXPECT_EQ(paper_row_of("rgbd_dataset_freiburg3_walking_xyz"), "fr3_walking_xyz");
  EXPECT_EQ(paper_row_of("rgbd_dataset_freiburg3_walking_halfsphere"), "fr3_walking_halfsphere");
  EXPECT_EQ(paper_row_of("rgbd_dataset_freiburg3_sitting_static"), "fr3_sitting_static");
  EXPECT_EQ(paper_row_of("fr3_walking_static"), "fr3_walking_static");
  EXPECT_EQ(paper_row_of("tum/fr3-walking-rpy"), "fr3_walking_rpy");
  EXPECT_EQ(paper_row_of("fr3_w_half"), "fr3_walking_halfsphere");
  EXPECT_EQ(paper_row_of("fr3_s_static"), "fr3_sitting_static");
  for (const char* other :
       {"rgbd_dataset_freiburg3_sitting_xyz", "rgbd_dataset_freiburg1_xyz", "walking_xyz",
        "rgbd_dataset_freiburg3_walking_xyz_validation", "freiburg2_walking_xyz"}) {
    EXPECT_FALSE(paper_row_of(other).has_value()) << other;
  }
}

TEST(FindSequences, TakesWhatIsMeantAsOneAndLeavesOutTheRest) {
  const TempFolder folder;
  const fs::path& root = folder.path();
  testing::write(root / "b/associations.txt", "x");
  testing::write(root / "a/deep/down/rgb.txt", "x");
  testing::write(root / "c ü/rgb/1.png", "x");
  testing::write(root / "c ü/depth/1.png", "x");
  testing::write(root / "notes/readme.txt", "x");
  testing::write(root / ".hidden/rgb.txt", "x");
  testing::write(root / "results/sweep.json", "{}");
  testing::write(root / "results/inner/rgb.txt", "x");
  testing::write(root / "b/inner/rgb.txt", "x");
  fs::create_directory_symlink(root, root / "notes" / "loop");
  EXPECT_EQ(names_in(root), (std::vector<std::string>{"a/deep/down", "b", "c ü"}));
  EXPECT_EQ(names_in(root / "b"), std::vector<std::string>{"b"}) << "the root itself";
  EXPECT_FALSE(find_sequences(root / "notes" / "readme.txt").ok());
  EXPECT_FALSE(find_sequences(root / "none").ok());
}

TEST(FindSequences, IdsAreSafeAndUnique) {
  const TempFolder folder;
  for (const char* name : {"a/b", "a__b", "c ü?", "-d"}) {
    testing::write(folder.path() / name / "rgb.txt", "x");
  }
  const auto found = find_sequences(folder.path());
  ASSERT_TRUE(found.ok());
  std::vector<std::string> ids;
  for (const auto& sequence : *found) ids.push_back(sequence.id);
  EXPECT_EQ(ids, (std::vector<std::string>{"_-d", "a__b", "a__b_2", "c_"}));
}

TEST(SelectSequences, KnowsNamesIdsAndLastParts) {
  const TempFolder folder;
  for (const char* name : {"x/one", "x/two", "three"}) {
    testing::write(folder.path() / name / "rgb.txt", "x");
  }
  const auto found = *find_sequences(folder.path());
  EXPECT_EQ(select_sequences(found, {})->size(), 3U);
  EXPECT_EQ(select_sequences(found, {"x__one", "three"})->size(), 2U);
  EXPECT_EQ(select_sequences(found, {"two"})->front().name, "x/two");
  const auto wrong = select_sequences(found, {"thre"});
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().kind, ErrorKind::kUsage);
  EXPECT_NE(wrong.error().message.find("did you mean 'three'"), std::string::npos);
}

TEST(InspectSequence, TellsKindFramesAndTruth) {
  const TempFolder folder;
  const fs::path root = folder.path() / "fr3_walking_xyz";
  testing::SmallSequence small;
  small.write_to(root);
  testing::write(root / "groundtruth.txt",
                 "1000 0 0 0 0 0 0 1\n1000.1 0.1 0 0 0 0 0 1\n1000.2 0.3 0 0 0 0 0 1\n"
                 "5000 9 0 0 0 0 0 1\n");
  const BenchSequence sequence = inspected(root);
  EXPECT_FALSE(sequence.error.has_value()) << *sequence.error;
  EXPECT_EQ(sequence.kind, "tum");
  EXPECT_EQ(sequence.paper_row, "fr3_walking_xyz");
  EXPECT_EQ(sequence.frames, 10U);
  ASSERT_TRUE(sequence.truth.has_value());
  EXPECT_NEAR(sequence.truth->length_m, 0.3, 1e-9) << "only at the time of the frames";
}

TEST(InspectSequence, ARenderedWorldIsKnownByItsOriginAndNeedsItsPeople) {
  const TempFolder folder;
  testing::SmallSequence small;
  small.write_to(folder.path() / "any");
  const auto origin = folder.path() / "any" / "simulation.json";
  testing::write(origin, R"({"world": "walking_rpy", "without": [], "faults": []})");
  EXPECT_EQ(inspected(folder.path() / "any").kind, "rendered");
  EXPECT_EQ(inspected(folder.path() / "any").paper_row, "fr3_walking_rpy");
  testing::write(origin, R"({"world": "walking_rpy", "without": ["people"]})");
  EXPECT_FALSE(inspected(folder.path() / "any").paper_row.has_value());
  testing::write(origin, R"({"world": "crowd"})");
  EXPECT_FALSE(inspected(folder.path() / "any").paper_row.has_value());
  testing::write(origin, "[1, 2");
  EXPECT_EQ(inspected(folder.path() / "any").kind, "rendered") << "a broken file is no reason";
  testing::SmallSequence marked;
  marked.calibration.insert(0, "# made by ygslam simulate\n");
  marked.write_to(folder.path() / "walking_static");
  EXPECT_EQ(inspected(folder.path() / "walking_static").paper_row, "fr3_walking_static");
}

TEST(InspectSequence, ABrokenOneSaysWhyWithoutTheFoldersOfThisMachine) {
  const TempFolder folder;
  testing::write(folder.path() / "broken/rgb.txt", "1.0 rgb/1.png\n");
  const BenchSequence sequence = inspected(folder.path() / "broken");
  ASSERT_TRUE(sequence.error.has_value());
  EXPECT_EQ(sequence.error->find("broken/depth.txt: "), 0U) << *sequence.error;
}

TEST(InspectSequence, TheFingerprintFollowsImagesAndTruth) {
  const TempFolder folder;
  testing::SmallSequence small;
  const fs::path root = folder.path() / "s";
  small.write_to(root);
  const std::string before = inspected(root).fingerprint;
  EXPECT_EQ(inspected(root).fingerprint, before);
  testing::write(root / "groundtruth.txt", "1000 0 0 0 0 0 0 1\n");
  const std::string with_truth = inspected(root).fingerprint;
  EXPECT_NE(with_truth, before);
  testing::write(root / small.colour_file(3), "x");
  EXPECT_NE(inspected(root).fingerprint, with_truth);
}

}  // namespace
}  // namespace ygslam
