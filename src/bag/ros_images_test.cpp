#include "bag/ros_images.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace ygslam::ros {
namespace {

const BagTopic kImages{"/images", kImageType, Layout::kCdr};
const BagTopic kCompressed{"/images/compressedDepth", kCompressedType, Layout::kCdr};

CameraConfig camera_of_size(int width, int height) {
  CameraConfig camera;
  camera.width = width;
  camera.height = height;
  camera.depth_scale = kMillimetres;
  return camera;
}

/// 2x2 pixels of two bytes each, with a byte of padding after a row.
Image small_image(const std::string& encoding) {
  return {{{1, 2}, "camera"}, 2, 2, encoding, 0, 5, {0xe8, 3, 0xd0, 7, 99, 0, 0, 0x88, 0x13}};
}

TEST(RosImages, DepthIsInMillimetresWithoutTheRowsPadding) {
  const auto depth_m =
      decode_depth(kImages, to_cdr(small_image("16UC1")), camera_of_size(2, 2), {});
  ASSERT_TRUE(depth_m.ok()) << depth_m.error().message;
  EXPECT_FLOAT_EQ(depth_m->at(0, 0), 1.0F);
  EXPECT_FLOAT_EQ(depth_m->at(1, 0), 2.0F);
  EXPECT_EQ(depth_m->at(0, 1), 0.0F) << "none";
  EXPECT_FLOAT_EQ(depth_m->at(1, 1), 5.0F);
}

TEST(RosImages, OtherByteOrdersAreTurned) {
  Image image = small_image("mono16");
  image.is_bigendian = 1;
  image.data = {3, 0xe8, 7, 0xd0, 99, 0, 0, 0x13, 0x88};
  const auto depth_m = decode_depth(kImages, to_cdr(image), camera_of_size(2, 2), {});
  ASSERT_TRUE(depth_m.ok()) << depth_m.error().message;
  EXPECT_FLOAT_EQ(depth_m->at(1, 1), 5.0F);
}

TEST(RosImages, AWrongByteOrderIsRefused) {
  constexpr int kSide = 32;
  Image image{{}, kSide, kSide, "16UC1", 1, 2 * kSide, {}};
  for (int i = 0; i < kSide * kSide; ++i) {
    const int units = 1000 + 3 * (i % kSide) + i / kSide;  // the low byte first, as it is not told
    image.data.push_back(static_cast<std::uint8_t>(units & 0xFF));
    image.data.push_back(static_cast<std::uint8_t>(units >> 8));
  }
  const auto camera = camera_of_size(kSide, kSide);
  const auto wrong = decode_depth(kImages, to_cdr(image), camera, {});
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().message.find("is_bigendian 1 is wrong"), std::string::npos);
  image.is_bigendian = 0;
  EXPECT_TRUE(decode_depth(kImages, to_cdr(image), camera, {}).ok());
}

TEST(RosImages, FloatsAreMetresAndNanIsNone) {
  const std::array<float, 2> metres = {1.25F, std::numeric_limits<float>::quiet_NaN()};
  Image image{{}, 1, 2, "32FC1", 0, 8, Bytes(8)};
  std::memcpy(image.data.data(), metres.data(), 8);
  const auto depth_m = decode_depth(kImages, to_cdr(image), camera_of_size(2, 1), {});
  ASSERT_TRUE(depth_m.ok()) << depth_m.error().message;
  EXPECT_EQ(depth_m->at(0, 0), 1.25F);
  EXPECT_EQ(depth_m->at(1, 0), 0.0F);
}

TEST(RosImages, CompressedFloatsAreKeptAsInverseDepth) {
  // As the transport writes them: q = a / depth + b.
  const float a = 100 * 101.0F;
  const float b = 1 - a / 10;
  ygslam::Image<std::uint16_t> raw(2, 1);
  raw.at(0, 0) = static_cast<std::uint16_t>(std::lround(a / 2.5F + b));
  raw.at(1, 0) = 0;
  const std::string png = encode_png(raw);
  CompressedImage image{{}, "32FC1; compressedDepth png", Bytes(12)};
  std::memcpy(image.data.data() + 4, &a, 4);
  std::memcpy(image.data.data() + 8, &b, 4);
  image.data.insert(image.data.end(), png.begin(), png.end());
  const auto depth_m = decode_depth(kCompressed, to_cdr(image), camera_of_size(2, 1), {});
  ASSERT_TRUE(depth_m.ok()) << depth_m.error().message;
  EXPECT_NEAR(depth_m->at(0, 0), 2.5F, 2e-3);
  EXPECT_EQ(depth_m->at(1, 0), 0.0F);
}

TEST(RosImages, ColoursAreTakenFromTheirPlaces) {
  for (const auto& [encoding, bytes] : {std::pair{"rgb8", Bytes{1, 2, 3}},
                                        {"bgr8", {3, 2, 1}},
                                        {"rgba8", {1, 2, 3, 255}},
                                        {"bgra8", {3, 2, 1, 255}}}) {
    const Image image{{}, 1, 1, encoding, 0, static_cast<std::uint32_t>(bytes.size()), bytes};
    const auto colour = decode_colour(kImages, to_cdr(image), {1, 1}, 3);
    ASSERT_TRUE(colour.ok()) << colour.error().message;
    EXPECT_EQ(colour->at(0, 0).r, 1) << encoding;
    EXPECT_EQ(colour->at(0, 0).g, 2) << encoding;
    EXPECT_EQ(colour->at(0, 0).b, 3) << encoding;
    EXPECT_EQ(decode_header(kImages, to_cdr(image))->channels, 3);
  }
  const Image grey{{}, 1, 1, "mono8", 0, 1, {7}};
  EXPECT_EQ(decode_header(kImages, to_cdr(grey))->channels, 1);
  EXPECT_EQ(decode_colour(kImages, to_cdr(grey), {1, 1}, 1)->at(0, 0).g, 7);
  EXPECT_FALSE(decode_colour(kImages, to_cdr(grey), {1, 1}, 3).ok()) << "never converted silently";
}

TEST(RosImages, MosaicsAreColoursWhereverTheirRedIs) {
  // Left half red, right half blue, as each mosaic shows it.
  constexpr int kSide = 16;
  for (const char* encoding : {"bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8"}) {
    const std::string cell = std::string(encoding).substr(6, 4);
    Image image{{}, kSide, kSide, encoding, 0, kSide, Bytes(kSide * kSide)};
    for (int v = 0; v < kSide; ++v)
      for (int u = 0; u < kSide; ++u) {
        const char seen = cell[static_cast<std::size_t>(2 * (v % 2) + u % 2)];
        image.data[static_cast<std::size_t>(v * kSide + u)] =
            seen == (u < kSide / 2 ? 'r' : 'b') ? 200 : 10;
      }
    const auto colour = decode_colour(kImages, to_cdr(image), {kSide, kSide}, 3);
    ASSERT_TRUE(colour.ok()) << colour.error().message;
    EXPECT_EQ(colour->at(3, 8), (Rgb8{200, 10, 10})) << encoding;
    EXPECT_EQ(colour->at(12, 8), (Rgb8{10, 10, 200})) << encoding;
    EXPECT_EQ(decode_header(kImages, to_cdr(image))->format, encoding);
    image.width = 15;
    EXPECT_FALSE(decode_colour(kImages, to_cdr(image), {15, kSide}, 3).ok()) << "odd";
  }
}

TEST(RosImages, YuvIsColourInBothOrders) {
  // BT.601: pure red has Y 82, U 90, V 240.
  for (const auto& [encoding, quad] : {std::pair{"yuv422", std::array{90, 82, 240, 82}},
                                       {"uyvy", {90, 82, 240, 82}},
                                       {"yuyv", {82, 90, 82, 240}},
                                       {"yuv422_yuy2", {82, 90, 82, 240}}}) {
    Image image{{}, 4, 4, encoding, 0, 8, {}};
    for (int i = 0; i < 8; ++i) image.data.insert(image.data.end(), quad.begin(), quad.end());
    const auto colour = decode_colour(kImages, to_cdr(image), {4, 4}, 3);
    ASSERT_TRUE(colour.ok()) << colour.error().message;
    EXPECT_NEAR(colour->at(2, 2).r, 255, 3) << encoding;
    EXPECT_NEAR(colour->at(2, 2).g, 0, 3) << encoding;
    EXPECT_NEAR(colour->at(2, 2).b, 0, 3) << encoding;
  }
}

TEST(RosImages, OpenCvsNamesAreColourAsOpenCvOrdersIt) {
  const Image three{{}, 1, 1, "8UC3", 0, 3, {3, 2, 1}};
  EXPECT_EQ(decode_colour(kImages, to_cdr(three), {1, 1}, 3)->at(0, 0), (Rgb8{1, 2, 3}));
  EXPECT_EQ(decode_header(kImages, to_cdr(three))->format, "8UC3 (as b, g, r)");
  const Image one{{}, 1, 1, "8UC1", 0, 1, {7}};
  EXPECT_EQ(decode_header(kImages, to_cdr(one))->channels, 1);
  EXPECT_EQ(decode_colour(kImages, to_cdr(one), {1, 1}, 1)->at(0, 0).g, 7);
  EXPECT_EQ(shown_encoding(kImages, to_cdr(small_image("rgb16"))), "rgb16");
}

/// Three bits in each nibble, the lowest first; what RVL is written with.
class RvlWriter {
 public:
  void add(std::uint32_t value) {
    do {
      std::uint32_t nibble = value & 7U;
      value >>= 3U;
      if (value != 0) nibble |= 8U;
      word_ = word_ << 4U | nibble;
      if (++count_ == 8) flush();
    } while (value != 0);
  }
  Bytes take() {
    for (; count_ != 0 && count_ < 8; ++count_) word_ <<= 4U;
    if (count_ == 8) flush();
    return bytes_;
  }

 private:
  void flush() {
    for (int i = 0; i < 4; ++i) bytes_.push_back(static_cast<std::uint8_t>(word_ >> (8 * i)));
    word_ = count_ = 0;
  }
  Bytes bytes_;
  std::uint32_t word_ = 0;
  int count_ = 0;
};

CompressedImage rvl_image(std::uint32_t width, std::uint32_t height) {
  RvlWriter writer;
  writer.add(1);          // one pixel without depth
  writer.add(3);          // three with
  writer.add(2 * 1000);   // 1000
  writer.add(2 * 5 - 1);  // 995: 5 less
  writer.add(2 * 4005);   // 5000
  CompressedImage image{{}, "16UC1; compressedDepth rvl", Bytes(12)};
  for (const std::uint32_t side : {width, height})
    for (int i = 0; i < 4; ++i) image.data.push_back(static_cast<std::uint8_t>(side >> (8 * i)));
  const Bytes code = writer.take();
  image.data.insert(image.data.end(), code.begin(), code.end());
  return image;
}

TEST(RosImages, RvlIsReadAndNothingOfItIsBelievedThatDoesNotFit) {
  const CameraConfig camera = camera_of_size(2, 2);
  const auto depth_m = decode_depth(kCompressed, to_cdr(rvl_image(2, 2)), camera, {});
  ASSERT_TRUE(depth_m.ok()) << depth_m.error().message;
  EXPECT_EQ(depth_m->at(0, 0), 0.0F);
  EXPECT_FLOAT_EQ(depth_m->at(1, 0), 1.0F);
  EXPECT_FLOAT_EQ(depth_m->at(0, 1), 0.995F);
  EXPECT_FLOAT_EQ(depth_m->at(1, 1), 5.0F);
  EXPECT_FALSE(decode_depth(kCompressed, to_cdr(rvl_image(2, 3)), camera, {}).ok());
  EXPECT_FALSE(decode_depth(kCompressed, to_cdr(rvl_image(1, 2)), camera_of_size(1, 2), {}).ok())
      << "more pixels than that";
  CompressedImage cut = rvl_image(2, 2);
  cut.data.pop_back();
  EXPECT_FALSE(decode_depth(kCompressed, to_cdr(cut), camera, {}).ok());
}

TEST(RosImages, WhatDoesNotFitIsRefusedWithTheReason) {
  const CameraConfig camera = camera_of_size(2, 2);
  const auto reason = [&](const Image& image) {
    return decode_depth(kImages, to_cdr(image), camera, {}).error().message;
  };
  Image image = small_image("16UC1");
  image.data.pop_back();
  EXPECT_NE(reason(image).find("fewer bytes"), std::string::npos);
  image = small_image("16UC1");
  image.step = 3;
  EXPECT_NE(reason(image).find("fewer bytes"), std::string::npos);
  image = small_image("16UC1");
  image.width = 3;
  EXPECT_NE(reason(image).find("other size: 3x2, expected 2x2"), std::string::npos);
  image.width = 0xffffffff;
  EXPECT_NE(reason(image).find("absurd size"), std::string::npos);
  EXPECT_NE(reason(small_image("bayer_rggb8")).find("bayer_rggb8"), std::string::npos);
  EXPECT_NE(reason(small_image("rgb8")).find("fewer bytes"), std::string::npos);
  Bytes cut = to_cdr(small_image("16UC1"));
  cut.resize(cut.size() - 4);
  EXPECT_FALSE(decode_depth(kImages, cut, camera, {}).ok());
  const CompressedImage tiny{{}, "16UC1; compressedDepth", {1, 2}};
  EXPECT_FALSE(decode_depth(kCompressed, to_cdr(tiny), camera, {}).ok());
}

TEST(RosImages, OfACameraOnlyWhatWeKnowIsTaken) {
  CameraInfo info;
  info.width = 640;
  info.height = 480;
  info.k = {500, 0, 320, 0, 510, 240, 0, 0, 1};
  info.p = {400, 0, 300, 0, 0, 410, 200, 0, 0, 0, 1, 0};
  info.d = {0.1, 0.2, 0.3, 0.4, 0.5};
  info.distortion_model = "plumb_bob";
  const auto camera = camera_of(info, false);
  ASSERT_TRUE(camera.ok());
  EXPECT_EQ(camera->fx, 500);
  EXPECT_EQ(camera->cy, 240);
  EXPECT_EQ(camera->k2, 0.2);
  EXPECT_EQ(camera->p1, 0.3);
  EXPECT_EQ(camera->k3, 0.5);
  EXPECT_EQ(camera->depth_scale, kMillimetres);
  EXPECT_EQ(camera->height, 480);
  const auto rectified = camera_of(info, true);
  EXPECT_EQ(rectified->fy, 410);
  EXPECT_FALSE(rectified->is_distorted());
  for (const auto& [K, words] : {std::pair{std::array<double, 9>{500, 5, 320, 0, 510, 240, 0, 0, 1},
                                           "its K has a skew of 5"},
                                 {{500, 0, 0, 0, 510, 0, 320, 240, 1}, "column by column"},
                                 {{0, 0, 0, 0, 0, 0, 0, 0, 0}, "is not calibrated"}}) {
    CameraInfo other = info;
    other.k = K;
    const auto refused = camera_of(other, false);
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.error().message.find(words), std::string::npos) << refused.error().message;
  }

  info.distortion_model = "rational_polynomial";
  info.d = {0.1, 0.2, 0.3, 0.4, 0.5, 0, 0, 0};
  EXPECT_TRUE(camera_of(info, false).ok());
  info.d.back() = 1e-3;
  EXPECT_FALSE(camera_of(info, false).ok());
  info.d = {0.1, 0, 0, 0};
  info.distortion_model = "equidistant";
  EXPECT_FALSE(camera_of(info, false).ok());
  info.d = {0, 0, 0, 0};
  EXPECT_TRUE(camera_of(info, false).ok()) << "none is none";
  info.binning_x = 2;
  EXPECT_FALSE(camera_of(info, false).ok());
  info.binning_x = 0;
  info.k = {};
  EXPECT_FALSE(camera_of(info, false).ok()) << "not calibrated";
}

}  // namespace
}  // namespace ygslam::ros
