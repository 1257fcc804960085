#include "bag/ros_images.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "bag/rvl.hpp"
#include "image/cv_view.hpp"
#include "io/camera_matrix.hpp"
#include "io/text.hpp"

namespace ygslam::ros {
namespace {

Error fault(std::string reason) { return {ErrorKind::kInput, std::move(reason)}; }

std::string_view text_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

constexpr int kPacked = -1;  // a pixel has its own red, green and blue

/// How a pixel lies in a message.
struct Encoding {
  std::string_view name;
  ImageKind kind;
  int bytes;
  std::array<int, 3> rgb{};     // places of red, green, blue
  int conversion = kPacked;     // else of OpenCV
  std::string_view taken_as{};  // where the name leaves that open, or it costs something
};
constexpr ImageKind kColour = ImageKind::kColour;
constexpr std::array<Encoding, 19> kEncodings = {
    {{"rgb8", kColour, 3, {0, 1, 2}},
     {"bgr8", kColour, 3, {2, 1, 0}},
     {"rgba8", kColour, 4, {0, 1, 2}},
     {"bgra8", kColour, 4, {2, 1, 0}},
     {"8UC3", kColour, 3, {2, 1, 0}, kPacked, "8UC3 (as b, g, r)"},
     {"8UC4", kColour, 4, {2, 1, 0}, kPacked, "8UC4 (as b, g, r, a)"},
     {"bayer_rggb8", kColour, 1, {}, cv::COLOR_BayerRGGB2RGB, "bayer_rggb8"},
     {"bayer_bggr8", kColour, 1, {}, cv::COLOR_BayerBGGR2RGB, "bayer_bggr8"},
     {"bayer_gbrg8", kColour, 1, {}, cv::COLOR_BayerGBRG2RGB, "bayer_gbrg8"},
     {"bayer_grbg8", kColour, 1, {}, cv::COLOR_BayerGRBG2RGB, "bayer_grbg8"},
     {"yuv422", kColour, 2, {}, cv::COLOR_YUV2RGB_UYVY, "yuv422 (u, y, v, y)"},
     {"uyvy", kColour, 2, {}, cv::COLOR_YUV2RGB_UYVY, "uyvy"},
     {"yuyv", kColour, 2, {}, cv::COLOR_YUV2RGB_YUYV, "yuyv"},
     {"yuv422_yuy2", kColour, 2, {}, cv::COLOR_YUV2RGB_YUYV, "yuv422_yuy2"},
     {"mono8", ImageKind::kGrey, 1, {0, 0, 0}},
     {"8UC1", ImageKind::kGrey, 1, {0, 0, 0}},
     {"16UC1", ImageKind::kDepth, 2},
     {"mono16", ImageKind::kDepth, 2},
     {"32FC1", ImageKind::kDepth, 4}}};

const Encoding* encoding_of(const std::string& name) {
  const auto* it = std::find_if(kEncodings.begin(), kEncodings.end(),
                                [&](const Encoding& e) { return e.name == name; });
  return it == kEncodings.end() ? nullptr : it;
}

/// The fields in front of an image's pixels.
struct ImageHead {
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.header, m.height, m.width, m.encoding);
  }
};

Result<Encoding> checked_encoding(const std::string& name, std::uint32_t width,
                                  std::uint32_t height) {
  if (width < 1 || height < 1 || width > kMaxImageSide_px || height > kMaxImageSide_px ||
      std::int64_t{width} * height > kMaxImagePixels)
    return fault("absurd size: " + std::to_string(width) + "x" + std::to_string(height));
  const Encoding* encoding = encoding_of(name);
  if (encoding == nullptr) return fault("encoding '" + printable(name) + "' is not read");
  return *encoding;
}

/// A raw image whose rows are there.
struct RawImage {
  Image message;
  Encoding encoding;
  [[nodiscard]] const std::uint8_t* row(int y) const {
    return message.data.data() + static_cast<std::size_t>(y) * message.step;
  }
};

Result<RawImage> read_raw(const BagTopic& topic, std::span<const std::uint8_t> bytes,
                          const ImageSize& size) {
  RawImage image;
  Image& m = image.message;
  if (!from_cdr(bytes, m, topic.layout)) return fault("the message ends early");
  const auto encoding = checked_encoding(m.encoding, m.width, m.height);
  if (!encoding.ok()) return encoding.error();
  image.encoding = *encoding;
  const ImageSize given = {static_cast<int>(m.width), static_cast<int>(m.height)};
  if (given != size)
    return fault("other size: " + shown_size(given) + ", expected " + shown_size(size));
  const std::uint64_t row_bytes = std::uint64_t{m.width} * static_cast<unsigned>(encoding->bytes);
  if (m.step < row_bytes || (m.height - 1) * std::uint64_t{m.step} + row_bytes > m.data.size())
    return fault("has fewer bytes than its size needs");
  return image;
}

/// A mosaic of single colours, or luma with half as many chroma values.
Result<ColourImage> converted(const RawImage& raw, const ImageSize& size) {
  if (size.width % 2 != 0 || size.height % 2 != 0 || size.width < 4 || size.height < 4)
    return fault("encoding " + raw.message.encoding + " needs even sides, has " + shown_size(size));
  ColourImage image(size.width, size.height);
  // OpenCV does not write to what it reads; its interface has no const.
  const cv::Mat stored(size.height, size.width, raw.encoding.bytes == 1 ? CV_8UC1 : CV_8UC2,
                       const_cast<std::uint8_t*>(raw.row(0)), raw.message.step);
  cv::Mat colour = cv_view(image);
  cv::cvtColor(stored, colour, raw.encoding.conversion);
  return image;
}

/// Depth samples of a raw image in this machine's byte order.
template <typename T>
ygslam::Image<T> depth_samples(const RawImage& raw) {
  const auto width = static_cast<int>(raw.message.width);
  const auto height = static_cast<int>(raw.message.height);
  ygslam::Image<T> image(width, height);
  for (int y = 0; y < height; ++y) {
    auto* row = reinterpret_cast<std::uint8_t*>(image.row(y));
    const std::size_t bytes = static_cast<std::size_t>(width) * sizeof(T);
    std::memcpy(row, raw.row(y), bytes);
    if (raw.message.is_bigendian == 0) continue;
    for (std::size_t i = 0; i < bytes; i += sizeof(T)) std::reverse(row + i, row + i + sizeof(T));
  }
  return image;
}

Result<CompressedImage> read_compressed(const BagTopic& topic,
                                        std::span<const std::uint8_t> bytes) {
  CompressedImage message;
  if (!from_cdr(bytes, message, topic.layout)) return fault("the message ends early");
  return message;
}

bool is_compressed_depth(const CompressedImage& message) {
  return message.format.find("compressedDepth") != std::string::npos;
}

/// compressed_depth_image_transport's raw values: a PNG, or width, height and RVL.
Result<ygslam::Image<std::uint16_t>> compressed_depth_values(const CompressedImage& message,
                                                             std::size_t head,
                                                             const ImageSize& size) {
  if (message.format.find("rvl") == std::string::npos)
    return ygslam::decode_depth(text_of(message.data).substr(head), size);
  std::array<std::uint32_t, 2> sides{};
  if (message.data.size() < head + sizeof sides) return fault("the message ends early");
  std::memcpy(sides.data(), message.data.data() + head, sizeof sides);
  if (sides[0] != static_cast<std::uint32_t>(size.width) ||
      sides[1] != static_cast<std::uint32_t>(size.height))
    return fault("other size: " + std::to_string(sides[0]) + "x" + std::to_string(sides[1]) +
                 ", expected " + shown_size(size));
  return decode_rvl(std::span(message.data).subspan(head + sizeof sides), size);
}

/// compressed_depth_image_transport: four bytes of kind and two numbers, then the image. Floats are
/// kept as a / depth + b.
Result<DepthImage> decode_compressed_depth(const CompressedImage& message,
                                           const CameraConfig& camera, const DepthConfig& config) {
  constexpr std::size_t kHead = 12;
  if (message.data.size() < kHead) return fault("the message ends early");
  float a = 0;
  float b = 0;
  std::memcpy(&a, message.data.data() + 4, sizeof a);
  std::memcpy(&b, message.data.data() + 8, sizeof b);
  const auto raw = compressed_depth_values(message, kHead, {camera.width, camera.height});
  if (!raw.ok()) return raw.error();
  if (!message.format.starts_with("32FC1")) return depth_from_raw(*raw, camera.depth_scale, config);
  DepthImage depth_m(raw->width(), raw->height());
  std::transform(raw->begin(), raw->end(), depth_m.begin(), [&](std::uint16_t value) {
    return value == 0 ? 0.0F : a / (static_cast<float>(value) - b);
  });
  return sanitized_depth(depth_m, config);
}

}  // namespace

std::optional<ImageKind> image_kind(const BagTopic& topic, std::span<const std::uint8_t> bytes) {
  if (topic.type == kImageType) {
    ImageHead head;
    if (!from_cdr(bytes, head, topic.layout)) return std::nullopt;
    const Encoding* encoding = encoding_of(head.encoding);
    return encoding == nullptr ? ImageKind::kOther : encoding->kind;
  }
  const auto message = read_compressed(topic, bytes);
  if (!message.ok()) return std::nullopt;
  if (is_compressed_depth(*message)) return ImageKind::kDepth;
  const auto header = ygslam::decode_header(text_of(message->data));
  if (!header.ok()) return ImageKind::kOther;
  if (header->bits == 16 || header->is_float) return ImageKind::kDepth;
  return header->channels <= 2 && !header->palette ? ImageKind::kGrey : ImageKind::kColour;
}

std::string shown_encoding(const BagTopic& topic, std::span<const std::uint8_t> bytes) {
  if (topic.type == kImageType) {
    ImageHead head;
    return from_cdr(bytes, head, topic.layout) ? printable(head.encoding, 24) : "";
  }
  const auto message = read_compressed(topic, bytes);
  return message.ok() ? printable(message->format, 24) : "";
}

Result<ImageHeader> decode_header(const BagTopic& topic, std::span<const std::uint8_t> bytes) {
  if (topic.type == kImageType) {
    ImageHead head;
    if (!from_cdr(bytes, head, topic.layout)) return fault("the message ends early");
    const auto encoding = checked_encoding(head.encoding, head.width, head.height);
    if (!encoding.ok()) return encoding.error();
    ImageHeader header{{static_cast<int>(head.width), static_cast<int>(head.height)}, 3, 8, false};
    if (encoding->kind == ImageKind::kGrey) header.channels = 1;
    if (!encoding->taken_as.empty()) header.format = encoding->taken_as;
    return header;
  }
  const auto message = read_compressed(topic, bytes);
  if (!message.ok()) return message.error();
  return ygslam::decode_header(text_of(message->data));
}

Result<ColourImage> decode_colour(const BagTopic& topic, std::span<const std::uint8_t> bytes,
                                  const ImageSize& size, int channels) {
  if (topic.type != kImageType) {
    const auto message = read_compressed(topic, bytes);
    if (!message.ok()) return message.error();
    return ygslam::decode_colour(text_of(message->data), size, channels);
  }
  const auto raw = read_raw(topic, bytes, size);
  if (!raw.ok()) return raw.error();
  const Encoding& encoding = raw->encoding;
  if (encoding.kind != (channels == 1 ? ImageKind::kGrey : ImageKind::kColour))
    return fault("other encoding: " + raw->message.encoding);
  if (encoding.conversion != kPacked) return converted(*raw, size);
  ColourImage image(size.width, size.height);
  for (int y = 0; y < size.height; ++y) {
    const std::uint8_t* pixel = raw->row(y);
    Rgb8* to = image.row(y);
    for (int x = 0; x < size.width; ++x, pixel += encoding.bytes)
      to[x] = {pixel[encoding.rgb[0]], pixel[encoding.rgb[1]], pixel[encoding.rgb[2]]};
  }
  return image;
}

Result<DepthImage> decode_depth(const BagTopic& topic, std::span<const std::uint8_t> bytes,
                                const CameraConfig& camera, const DepthConfig& config) {
  const ImageSize size = {camera.width, camera.height};
  if (topic.type == kImageType) {
    const auto raw = read_raw(topic, bytes, size);
    if (!raw.ok()) return raw.error();
    if (raw->encoding.name == "32FC1") return sanitized_depth(depth_samples<float>(*raw), config);
    if (raw->encoding.kind != ImageKind::kDepth)
      return fault("other encoding: " + raw->message.encoding);
    const auto samples = depth_samples<std::uint16_t>(*raw);
    if (has_swapped_bytes(samples))
      return fault("16-bit depth with its bytes swapped (neighbours jump by 256s): is_bigendian " +
                   std::to_string(raw->message.is_bigendian) + " is wrong");
    return depth_from_raw(samples, camera.depth_scale, config);
  }
  const auto message = read_compressed(topic, bytes);
  if (!message.ok()) return message.error();
  if (is_compressed_depth(*message)) return decode_compressed_depth(*message, camera, config);
  return decode_depth_m(text_of(message->data), size, camera.depth_scale, config);
}

Result<CameraConfig> camera_of(const CameraInfo& info, bool rectified) {
  const auto refuse = [](const std::string& what) { return Error{ErrorKind::kConfig, what}; };
  if (info.binning_x > 1 || info.binning_y > 1 || info.roi[0] != 0 || info.roi[1] != 0)
    return refuse("is of a binned or cut image, which is not read");
  CameraConfig camera;
  camera.depth_scale = kMillimetres;
  camera.width = static_cast<int>(std::min<std::uint32_t>(info.width, kMaxImageSide_px + 1));
  camera.height = static_cast<int>(std::min<std::uint32_t>(info.height, kMaxImageSide_px + 1));
  if (rectified && info.p[0] != 0) {
    camera.fx = info.p[0], camera.fy = info.p[5], camera.cx = info.p[2], camera.cy = info.p[6];
    return camera;
  }
  if (info.k[0] == 0) return refuse("is not calibrated (its focal length is 0)");
  std::array<double, 9> K = info.k;
  if (K[8] == 0) K[8] = 1;  // which some drivers forget
  if (const std::string wrong = set_camera_matrix(camera, K); !wrong.empty())
    return refuse("its K " + wrong);
  const bool is_zero =
      std::all_of(info.d.begin(), info.d.end(), [](double term) { return term == 0; });
  if (is_zero) return camera;
  constexpr std::size_t kTerms = 5;
  if (info.distortion_model != "plumb_bob" && info.distortion_model != "rational_polynomial")
    return refuse("has distortion of model '" + info.distortion_model.substr(0, 40) +
                  "', which is not read");
  if (std::any_of(info.d.begin() + static_cast<std::ptrdiff_t>(std::min(kTerms, info.d.size())),
                  info.d.end(), [](double term) { return term != 0; }))
    return refuse("has more terms of distortion than the five of plumb_bob");
  constexpr std::array<double CameraConfig::*, kTerms> kOrder = {
      &CameraConfig::k1, &CameraConfig::k2, &CameraConfig::p1, &CameraConfig::p2,
      &CameraConfig::k3};
  for (std::size_t i = 0; i < std::min(kTerms, info.d.size()); ++i) camera.*kOrder[i] = info.d[i];
  return camera;
}

}  // namespace ygslam::ros
