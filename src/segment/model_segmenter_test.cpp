#include "segment/model_segmenter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <new>
#include <openvino/core/model.hpp>

#include "core/testing/memory_limit.hpp"
#include "segment/cpu_features.hpp"
#include "segment/letterbox.hpp"
#include "segment/movable.hpp"
#include "segment/test_network.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::make_test_network;
using testing::TestNetwork;
using testing::write_network;

class ModelSegmenterTest : public ::testing::Test {
 protected:
  ModelSegmenterTest()
      : dir_(fs::temp_directory_path() / ("ygslam_yolo_" + std::to_string(getpid()))) {
    fs::create_directories(dir_);
  }
  ~ModelSegmenterTest() override { fs::remove_all(dir_); }

  ModelConfig config_for(const TestNetwork& shape) {
    ModelConfig config;
    config.model = dir_ / "net.xml";
    write_network(make_test_network(shape), config.model);
    return config;
  }
  ModelConfig config_for_bytes(const std::string& bytes, const char* name) {
    ModelConfig config;
    config.model = dir_ / name;
    config.try_in_child = true;
    std::ofstream(config.model, std::ios::binary) << bytes;
    return config;
  }
  /// Black with a red rectangle [u0, u1) x [v0, v1).
  static RgbdFrame red_frame(int width, int height, int u0, int v0, int u1, int v1) {
    RgbdFrame frame{FrameId{7}, Timestamp{123456789}, ColourImage(width, height), {}, {}};
    for (int v = v0; v < v1; ++v) {
      for (int u = u0; u < u1; ++u) frame.colour.at(u, v) = {255, 0, 0};
    }
    return frame;
  }
  static void expect_model_error(const ModelConfig& config, const std::string& what) {
    const auto made = make_model_segmenter(config);
    ASSERT_FALSE(made.ok());
    EXPECT_EQ(made.error().kind, ErrorKind::kModel) << made.error().message;
    EXPECT_THAT(made.error().message, HasSubstr(config.model.string()));
    EXPECT_THAT(made.error().message, HasSubstr(what));
    EXPECT_EQ(made.error().message.find('\n'), std::string::npos);
  }

  fs::path dir_;
};

/// Share of the pixels, farther than `slack_px` from the rectangle's edge, that are right.
void expect_mask_is_rectangle(const Segmentation& s, int u0, int v0, int u1, int v1, int slack_px) {
  for (int v = 0; v < s.ids.height(); ++v) {
    for (int u = 0; u < s.ids.width(); ++u) {
      const int inset = std::min({u - u0, u1 - 1 - u, v - v0, v1 - 1 - v});
      if (inset >= -slack_px && inset < slack_px) continue;
      ASSERT_EQ(s.ids.at(u, v), inset >= 0 ? 1 : 0) << u << " " << v;
    }
  }
}

TEST_F(ModelSegmenterTest, IsMadeWhereTheProcessorIsAskedFirstAndAnswersRight) {
  ModelConfig config = config_for({});
  config.check_processor = true;
  const auto made = make_model_segmenter(config);
  EXPECT_TRUE(made.ok()) << made.error().message;
}

TEST_F(ModelSegmenterTest, MaskLiesWhereTheNetworkSawItAndCarriesTheFramesId) {
  const auto made = make_model_segmenter(config_for({}));
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto out = made.value()->segment(red_frame(640, 480, 160, 120, 400, 360));
  ASSERT_TRUE(out.ok()) << out.error().message;
  EXPECT_EQ(out->frame, FrameId{7});
  EXPECT_EQ(out->stamp.ns, 123456789);
  ASSERT_EQ(out->instances.size(), 1U);
  EXPECT_EQ(out->instances[0].class_id, 0);
  EXPECT_NEAR(out->instances[0].score, 0.9, 0.01);
  expect_mask_is_rectangle(*out, 160, 120, 400, 360, 3);
  EXPECT_EQ(out->edge_px, 2) << "half a cell of its masks";
}

TEST_F(ModelSegmenterTest, AnyImageSizeGoesThroughTheLetterboxAndBack) {
  const auto made = make_model_segmenter(config_for({}));
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto out = made.value()->segment(red_frame(1280, 720, 400, 200, 900, 600));
  ASSERT_TRUE(out.ok()) << out.error().message;
  EXPECT_EQ(out->ids.width(), 1280);
  EXPECT_EQ(out->ids.height(), 720);
  expect_mask_is_rectangle(*out, 400, 200, 900, 600, 6);
  EXPECT_EQ(out->edge_px, 4);
  const auto small = made.value()->segment(red_frame(100, 160, 20, 40, 80, 120));
  ASSERT_TRUE(small.ok());
  expect_mask_is_rectangle(*small, 20, 40, 80, 120, 2);
}

TEST_F(ModelSegmenterTest, OtherInputSizesAreTakenStaticOrOpen) {
  TestNetwork other;
  other.width = 512;
  other.height = 384;
  const auto fixed = make_model_segmenter(config_for(other));
  ASSERT_TRUE(fixed.ok()) << fixed.error().message;
  const auto a = fixed.value()->segment(red_frame(640, 480, 160, 120, 400, 360));
  ASSERT_TRUE(a.ok());
  expect_mask_is_rectangle(*a, 160, 120, 400, 360, 4);

  TestNetwork open;
  open.width = open.height = 0;
  ModelConfig config = config_for(open);
  config.input_width = 320;
  config.input_height = 256;
  const auto dynamic = make_model_segmenter(config);
  ASSERT_TRUE(dynamic.ok()) << dynamic.error().message;
  const auto b = dynamic.value()->segment(red_frame(640, 480, 160, 120, 400, 360));
  ASSERT_TRUE(b.ok());
  expect_mask_is_rectangle(*b, 160, 120, 400, 360, 6);
}

TEST_F(ModelSegmenterTest, SameImageGivesTheSameMask) {
  const auto made = make_model_segmenter(config_for({}));
  ASSERT_TRUE(made.ok());
  const RgbdFrame frame = red_frame(640, 480, 33, 57, 301, 211);
  const auto a = made.value()->segment(frame);
  const auto b = made.value()->segment(frame);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_TRUE(std::equal(a->ids.begin(), a->ids.end(), b->ids.begin()));
}

TEST_F(ModelSegmenterTest, NanFromTheNetworkIsAnErrorForThatFrameOnly) {
  TestNetwork broken;
  broken.score = std::numeric_limits<float>::quiet_NaN();
  const auto made = make_model_segmenter(config_for(broken));
  ASSERT_TRUE(made.ok()) << made.error().message;
  for (int i = 0; i < 2; ++i) {
    const auto out = made.value()->segment(red_frame(640, 480, 0, 0, 100, 100));
    ASSERT_FALSE(out.ok());
    EXPECT_EQ(out.error().kind, ErrorKind::kModel);
    EXPECT_THAT(out.error().message, HasSubstr("frame 7"));
  }
}

TEST_F(ModelSegmenterTest, FrameWithoutColourIsAnErrorForThatFrame) {
  const auto made = make_model_segmenter(config_for({}));
  ASSERT_TRUE(made.ok());
  EXPECT_FALSE(made.value()->segment(RgbdFrame{}).ok());
  EXPECT_TRUE(made.value()->segment(red_frame(64, 48, 0, 0, 10, 10)).ok());
}

TEST_F(ModelSegmenterTest, PrecisionFollowsModelAndProcessor) {
  ModelConfig config = config_for({});
  const auto automatic = make_model_segmenter(config);
  ASSERT_TRUE(automatic.ok());
  EXPECT_EQ(automatic.value()->precision(), cpu_bf16() == Bf16::kFast ? "bf16" : "f32");

  config.precision = Precision::kInt8;
  const auto int8 = make_model_segmenter(config);
  ASSERT_FALSE(int8.ok());
  EXPECT_EQ(int8.error().kind, ErrorKind::kConfig);
  EXPECT_THAT(int8.error().message, HasSubstr("quantised"));

  config.precision = Precision::kBf16;
  const auto bf16 = make_model_segmenter(config);
  if (cpu_bf16() == Bf16::kNone) {
    ASSERT_FALSE(bf16.ok());
    EXPECT_EQ(bf16.error().kind, ErrorKind::kConfig);
  } else {
    ASSERT_TRUE(bf16.ok());
    EXPECT_EQ(bf16.value()->precision(), "bf16");
  }
}

TEST_F(ModelSegmenterTest, QuantisedModelRunsInInt8) {
  TestNetwork quantised;
  quantised.quantised = true;
  ModelConfig config = config_for(quantised);
  for (const Precision p : {Precision::kAuto, Precision::kInt8}) {
    config.precision = p;
    const auto made = make_model_segmenter(config);
    ASSERT_TRUE(made.ok()) << made.error().message;
    EXPECT_EQ(made.value()->precision(), "int8");
    const auto out = made.value()->segment(red_frame(640, 480, 160, 120, 400, 360));
    ASSERT_TRUE(out.ok());
    expect_mask_is_rectangle(*out, 160, 120, 400, 360, 3);
  }
  for (const Precision p : {Precision::kF32, Precision::kBf16}) {
    config.precision = p;
    const auto made = make_model_segmenter(config);
    ASSERT_FALSE(made.ok());
    EXPECT_EQ(made.error().kind, ErrorKind::kConfig);
  }
}

TEST_F(ModelSegmenterTest, MissingEmptyOrNoFileIsAModelError) {
  ModelConfig config;
  config.model = dir_ / "nowhere.onnx";
  expect_model_error(config, "no such");
  config.model = dir_;
  expect_model_error(config, "not a file");
  expect_model_error(config_for_bytes("", "empty.onnx"), "empty");
}

TEST_F(ModelSegmenterTest, GarbageIsAModelErrorWhateverItsName) {
  std::string noise(5000, '\0');
  for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = static_cast<char>(i * 7919 >> 3);
  for (const char* name : {"a.onnx", "a.xml", "a.pt", "a", "with space ü.onnx"}) {
    expect_model_error(config_for_bytes(noise, name), "");
    expect_model_error(config_for_bytes("hello", name), "");
  }
}

TEST_F(ModelSegmenterTest, TruncatedNetworkIsAModelError) {
  const ModelConfig config = config_for({});
  const fs::path weights = fs::path(config.model).replace_extension("bin");
  fs::resize_file(weights, fs::file_size(weights) / 2);
  expect_model_error(config, "cannot be read");
  const ModelConfig whole = config_for({});
  fs::resize_file(whole.model, fs::file_size(whole.model) / 2);
  expect_model_error(whole, "cannot be read");
  fs::remove(weights);
  expect_model_error(config_for_bytes("<net/>", "net.xml"), "");
}

TEST_F(ModelSegmenterTest, NetworkOfAnotherShapeIsAModelErrorThatNamesTheShape) {
  TestNetwork few_channels;
  few_channels.channels = 84;  // 48 classes, of which the file does not say which they are
  expect_model_error(config_for(few_channels), "48 classes without names");
  TestNetwork few_prototypes;
  few_prototypes.prototypes = 16;
  expect_model_error(config_for(few_prototypes), "[1,16,120,160]");
  TestNetwork odd;
  odd.width = 648;
  expect_model_error(config_for(odd), "648x480");
  TestNetwork huge;
  huge.width = huge.height = 32000;
  expect_model_error(config_for(huge), "32000x32000");
}

TEST_F(ModelSegmenterTest, BadNumbersAreConfigurationErrors) {
  const ModelConfig good = config_for({});
  const auto expect_config_error = [](const ModelConfig& config) {
    const auto made = make_model_segmenter(config);
    ASSERT_FALSE(made.ok());
    EXPECT_EQ(made.error().kind, ErrorKind::kConfig) << made.error().message;
  };
  ModelConfig bad = good;
  bad.threads = 0;
  expect_config_error(bad);
  bad = good;
  bad.decode.score_threshold = std::numeric_limits<double>::quiet_NaN();
  expect_config_error(bad);
  bad = good;
  bad.decode.max_instances = 256;
  expect_config_error(bad);
  bad = good;
  bad.input_width = 100;
  expect_config_error(bad);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST_F(ModelSegmenterTest, WantOfMemoryIsNoFaultOfTheModel) {
  if (testing::is_emulated()) GTEST_SKIP() << "QEMU knows no limit of memory";
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // OpenVINO's threads do not survive a fork
  const ModelConfig config = config_for({});
  int refused = 0;
  for (const std::size_t extra_mb : {16, 64, 124, 132, 140, 160, 200, 300}) {
    const auto child = [&] {
      testing::limit_memory(extra_mb);
      try {
        const auto made = make_model_segmenter(config);
        if (!made.ok()) std::fprintf(stderr, "%s\n", made.error().message.c_str());
        std::_Exit(made.ok() ? 0 : 2);
      } catch (const std::bad_alloc&) {
        std::_Exit(1);
      }
    };
    refused += testing::refusals_of(child, extra_mb);
  }
  EXPECT_GE(refused, 3);
}
#endif

}  // namespace
}  // namespace ygslam
