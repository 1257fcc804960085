// The trained network on recorded images; runs where $YGSLAM_SHARED (else ../shared) has them.
#include <gtest/gtest.h>

#include <fstream>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/testing/recorded_data.hpp"
#include "image/cv_view.hpp"
#include "segment/model_segmenter.hpp"
#include "segment/movable.hpp"
#include "segment/png_ids.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

using testing::shared_folder;

fs::path model_file() { return shared_folder() / "models" / "yolov8n-seg_480x640.onnx"; }

RgbdFrame read_frame(const fs::path& file) {
  const cv::Mat bgr = cv::imread(file.string(), cv::IMREAD_COLOR);
  RgbdFrame frame{FrameId{0}, {}, ColourImage(bgr.cols, bgr.rows), {}, {}};
  cv::cvtColor(bgr, cv_view(frame.colour), cv::COLOR_BGR2RGB);
  return frame;
}

/// Intersection over union of "a > 0" and "b > 0"; nullopt where b is empty.
std::optional<double> mask_iou(const GreyImage& a, const GreyImage& b) {
  int both = 0, either = 0, wanted = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool in_a = a.data()[i] > 0;
    const bool in_b = b.data()[i] > 0;
    both += in_a && in_b ? 1 : 0;
    either += in_a || in_b ? 1 : 0;
    wanted += in_b ? 1 : 0;
  }
  if (wanted == 0) return std::nullopt;
  return static_cast<double>(both) / either;
}

TEST(TrainedYolo, PersonMasksMatchTheRecordedOnes) {
  const fs::path data = shared_folder() / "data" / "redkitchen_walk";
  YGSLAM_NEEDS_RECORDED(data);
  YGSLAM_NEEDS_RECORDED(model_file());
  ModelConfig config;
  config.model = model_file();
  config.decode.classes = {0};
  const auto made = make_model_segmenter(config);
  ASSERT_TRUE(made.ok()) << made.error().message;

  std::vector<fs::path> masks;
  for (const auto& entry : fs::directory_iterator(data / "mask")) masks.push_back(entry.path());
  std::sort(masks.begin(), masks.end());
  double sum = 0;
  int frames = 0;
  for (std::size_t i = 0; i < masks.size(); i += 6) {
    const auto truth = read_png_ids(masks[i]);
    ASSERT_TRUE(truth.ok());
    const auto image = data / "rgb" / masks[i].filename().replace_extension("jpg");
    const auto out = made.value()->segment(read_frame(image));
    ASSERT_TRUE(out.ok()) << out.error().message;
    if (const auto iou = mask_iou(out->ids, *truth)) {
      sum += *iou;
      ++frames;
    }
  }
  ASSERT_GT(frames, 20);
  std::cout << "IoU " << sum / frames << " over " << frames << " frames\n";
  EXPECT_GT(sum / frames, 0.85);
}

TEST(TrainedYolo, MaskOfALetterboxedImageAgreesWithTheFullSizeOne) {
  const fs::path file = shared_folder() / "data" / "images" / "bus.jpg";
  YGSLAM_NEEDS_RECORDED(file);
  YGSLAM_NEEDS_RECORDED(model_file());
  ModelConfig config;
  config.model = model_file();
  config.decode.classes = {0, 5};
  const auto made = make_model_segmenter(config);
  ASSERT_TRUE(made.ok());
  const RgbdFrame frame = read_frame(file);
  const auto out = made.value()->segment(frame);
  ASSERT_TRUE(out.ok());
  EXPECT_TRUE(out->ids.same_size(frame.colour));
  int people = 0, buses = 0;
  for (const Instance& i : out->instances) {
    people += i.class_id == 0 && i.score > 0.5F ? 1 : 0;
    buses += i.class_id == 5 && i.score > 0.5F ? 1 : 0;
  }
  EXPECT_GE(people, 3);
  EXPECT_EQ(buses, 1);
}

TEST(TrainedYolo, TruncatedFileIsAModelError) {
  YGSLAM_NEEDS_RECORDED(model_file());
  const fs::path copy = fs::temp_directory_path() / "ygslam_truncated.onnx";
  std::ifstream in(model_file(), std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  for (const double share : {0.01, 0.3, 0.9, 0.9999}) {
    std::ofstream(copy, std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(share * bytes.size()));
    ModelConfig config;
    config.model = copy;
    const auto made = make_model_segmenter(config);
    ASSERT_FALSE(made.ok()) << share;
    EXPECT_EQ(made.error().kind, ErrorKind::kModel);
  }
  fs::remove(copy);
}

}  // namespace
}  // namespace ygslam
