// Images and cameras out of messages.
#pragma once

#include <optional>
#include <string>

#include "bag/bag.hpp"
#include "bag/ros_messages.hpp"
#include "geometry/camera.hpp"
#include "image/depth.hpp"
#include "io/image_file.hpp"

namespace ygslam::ros {

inline constexpr const char* kImageType = "sensor_msgs/Image";
inline constexpr const char* kCompressedType = "sensor_msgs/CompressedImage";
inline constexpr const char* kCameraType = "sensor_msgs/CameraInfo";

/// REP 118: 16-bit depth is in millimetres.
inline constexpr double kMillimetres = 1000;

enum class ImageKind { kColour, kGrey, kDepth, kOther };

/// What a message of an image type shows. @return nothing if it cannot be read.
[[nodiscard]] std::optional<ImageKind> image_kind(const BagTopic& topic,
                                                  std::span<const std::uint8_t> bytes);

/// What a message calls its encoding or format, for messages.
[[nodiscard]] std::string shown_encoding(const BagTopic& topic,
                                         std::span<const std::uint8_t> bytes);

// Faults are kInput with a reason alone.

[[nodiscard]] Result<ImageHeader> decode_header(const BagTopic& topic,
                                                std::span<const std::uint8_t> bytes);
/// rgb8, bgr8, rgba8, bgra8, 8UC3 and 8UC4 (as b, g, r), mosaics of Bayer, YUV 4:2:2, mono8, 8UC1,
/// JPEG, PNG; see ygslam::decode_colour().
[[nodiscard]] Result<ColourImage> decode_colour(const BagTopic& topic,
                                                std::span<const std::uint8_t> bytes,
                                                const ImageSize& size, int channels);
/// 16UC1 and mono16 (raw units), 32FC1 (metres), what decode_depth_m() reads, compressedDepth of
/// both (PNG and RVL).
/// @param camera size and depth_scale.
[[nodiscard]] Result<DepthImage> decode_depth(const BagTopic& topic,
                                              std::span<const std::uint8_t> bytes,
                                              const CameraConfig& camera,
                                              const DepthConfig& config);

/// @param rectified take the camera of the rectified image: no distortion.
/// @return kConfig with a reason alone: another model than plumb_bob (or what is the same), a part
/// of the image only, no focal length.
[[nodiscard]] Result<CameraConfig> camera_of(const CameraInfo& info, bool rectified);

}  // namespace ygslam::ros
