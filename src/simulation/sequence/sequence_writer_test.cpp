#include "simulation/sequence/sequence_writer.hpp"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "io/frame_loader.hpp"
#include "io/testing/file_size_limit.hpp"
#include "io/tum_sequence.hpp"
#include "simulation/sequence/test_worlds.hpp"

namespace ygslam::sim {
namespace {

namespace fs = std::filesystem;

class SequenceFiles : public ::testing::Test {
 protected:
  SequenceFiles() {
    folder_ = fs::temp_directory_path() /
              ("ygslam_sim_" + std::to_string(getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
  }
  ~SequenceFiles() override { fs::remove_all(folder_); }

  static Status write(const fs::path& folder, const SequenceOptions& options,
                      const WriteOptions& files) {
    SequenceSource source = open_or_die("crowd", options);
    Result<SequenceWriter> writer = SequenceWriter::create(folder, source, files);
    if (!writer) return writer.error();
    while (auto frame = source.next_with_losses()) {
      if (Status status = writer->add(*frame, source); !status) return status;
    }
    return writer->finish(source);
  }
  static std::string content(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    std::stringstream text;
    text << stream.rdbuf();
    return text.str();
  }
  fs::path folder_;
};

SequenceOptions truth_options() {
  SequenceOptions options = small_options(0.6, 5);
  options.noise = NoiseKind::kKinect;
  options.truth_static = options.truth_things = true;
  return options;
}

TEST_F(SequenceFiles, AreByteIdenticalWithOneSeed) {
  ASSERT_TRUE(write(folder_ / "a", truth_options(), {.truth = true}).ok());
  ASSERT_TRUE(write(folder_ / "b", truth_options(), {.truth = true}).ok());
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "a")) {
    if (!entry.is_regular_file()) continue;
    ++files;
    EXPECT_EQ(content(entry.path()),
              content(folder_ / "b" / fs::relative(entry.path(), folder_ / "a")))
        << entry.path();
  }
  EXPECT_GT(files, 3 * 7);
}

TEST_F(SequenceFiles, ReadBackAsWritten) {
  const SequenceOptions options = truth_options();
  ASSERT_TRUE(write(folder_, options, {.jpeg = false}).ok());
  const auto sequence = open_tum_sequence(folder_);
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  const auto frames = all_frames(open_or_die("crowd", options));
  ASSERT_EQ(sequence->pairs.size(), frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto frame = load_frame(*sequence, i);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    EXPECT_EQ(frame->stamp, frames[i].frame->stamp);
    EXPECT_TRUE(same_pixels(frame->colour, frames[i].frame->colour));
    EXPECT_TRUE(same_pixels(frame->grey, frames[i].frame->grey));
    for (std::size_t k = 0; k < frame->depth_m.size(); ++k) {
      ASSERT_NEAR(frame->depth_m.data()[k], frames[i].frame->depth_m.data()[k], 1e-5F);
    }
  }
}

// Depth of a camera of its own, with another lens, size and place, is registered on reading: what
// comes out is what the colour camera would have seen.
TEST_F(SequenceFiles, DepthOfASecondCameraIsRegisteredToColour) {
  SequenceOptions options = truth_options();
  options.noise = NoiseKind::kNone;
  DepthCamera depth;
  depth.camera.fx = depth.camera.fy = 110;
  depth.camera.cx = 99.5, depth.camera.cy = 59.5;
  depth.camera.width = 200, depth.camera.height = 120;
  depth.camera.depth_scale = 2000;
  depth.T_colour_depth = {so3_exp({0.01, -0.02, 0.005}), {0.025, 0.002, -0.003}};
  options.depth_camera = depth;
  ASSERT_TRUE(write(folder_, options, {.jpeg = false}).ok());
  const auto sequence = open_tum_sequence(folder_);
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  ASSERT_NE(sequence->registration, nullptr);
  EXPECT_NEAR(sequence->registration->baseline_m(), 0.0253, 1e-4);
  const auto frames = all_frames(open_or_die("crowd", options));
  ASSERT_EQ(sequence->pairs.size(), frames.size());
  int both = 0, equal = 0, truth = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto frame = load_frame(*sequence, i, {.min_m = 0.1, .max_m = 12});
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const DepthImage& true_m = frames[i].depth_true_m;
    ASSERT_TRUE(frame->depth_m.same_size(true_m));
    for (std::size_t k = 0; k < true_m.size(); ++k) {
      if (!(true_m.data()[k] > 0.1F && true_m.data()[k] < 12)) continue;
      ++truth;
      if (!(frame->depth_m.data()[k] > 0)) continue;
      ++both;
      equal += std::abs(frame->depth_m.data()[k] - true_m.data()[k]) < 0.02F * true_m.data()[k];
    }
  }
  EXPECT_GT(both, 0.93 * truth) << "the rest only the colour camera sees";
  EXPECT_GT(equal, 0.95 * both) << "the rest are borders of things";
}

TEST_F(SequenceFiles, FullDiskLeavesNoSequenceThatLooksWhole) {
  ASSERT_TRUE(write(folder_, truth_options(), {.jpeg = true}).ok());  // an earlier sequence ...
  std::ofstream(folder_ / "simulation.json") << "{}";                 // ... that was rendered
  const Status status = [&] {
    const ygslam::testing::FileSizeLimit full(2000);
    return write(folder_, truth_options(), {.jpeg = true});
  }();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::kOutput);
  for (const char* list :
       {"rgb.txt", "depth.txt", "associations.txt", "groundtruth.txt", "calibration.txt"}) {
    EXPECT_FALSE(fs::exists(folder_ / list)) << list;
  }
}

TEST_F(SequenceFiles, TruncatedFilesAreShorter) {
  SequenceOptions options = truth_options();
  ASSERT_TRUE(write(folder_ / "a", options, {}).ok());
  options.faults = {*parse_fault("rgb:truncate@0.2+0.1")};
  ASSERT_TRUE(write(folder_ / "b", options, {}).ok());
  const char* name = "rgb/1000.200000.jpg";
  EXPECT_LT(fs::file_size(folder_ / "b" / name), fs::file_size(folder_ / "a" / name));
  EXPECT_EQ(fs::file_size(folder_ / "b/rgb/1000.000000.jpg"),
            fs::file_size(folder_ / "a/rgb/1000.000000.jpg"));
}

}  // namespace
}  // namespace ygslam::sim
