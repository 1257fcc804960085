// A recorded RGB-D sequence: which image pairs there are, where their images come from, the camera.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "geometry/camera.hpp"
#include "image/depth.hpp"
#include "io/depth_registration.hpp"
#include "io/image_file.hpp"
#include "io/image_list.hpp"

namespace ygslam {

/// Decodes images by their names. Faults are kInput with a reason alone ("truncated PNG"); callers
/// put the place in front. May be called from several threads at once.
class ImageSource {
 public:
  virtual ~ImageSource() = default;

  /// Of an image, without decoding it.
  [[nodiscard]] virtual Result<ImageHeader> header(const std::string& name) const = 0;
  /// @param size any other is an error. @param channels 3, or 1 for grey recordings.
  [[nodiscard]] virtual Result<ColourImage> colour(const std::string& name, const ImageSize& size,
                                                   int channels) const = 0;
  /// @param camera gives the size (any other is an error) and the raw units per metre.
  [[nodiscard]] virtual Result<DepthImage> depth_m(const std::string& name,
                                                   const CameraConfig& camera,
                                                   const DepthConfig& config) const = 0;
};

/// One pair as listed; the images may still turn out unreadable.
struct SequencePair {
  Timestamp stamp;   ///< of the colour image, strictly increasing over the sequence
  int decimals = 0;  ///< digits after the point of the colour stamp as written
  Timestamp depth_stamp;
  std::string colour_file, depth_file;  ///< relative to the root, or messages of a bag
};

/// What the user says of the cameras, in place of what the recording says.
struct GivenCameras {
  std::optional<CameraConfig> colour{};
  std::string colour_source = "given camera";  ///< a file, for messages
  std::optional<DepthCamera> depth{};
  std::string depth_source = "given depth camera";
};

class FrameStream;

struct SkippedImage {
  std::string file;    ///< as the pair names it
  std::string reason;  ///< "missing", "truncated PNG", "other size: ...", ...
};

/// A topic that may tell how the camera moves.
struct MotionTopic {
  std::string name;
  /// Of an IMU, or of the frame that odometry moves, by the recording's /tf_static.
  std::optional<SE3> T_frame_camera{};
  std::string missing{};   ///< why it is not known
  std::string changed{};   ///< its messages name another frame on the way; empty: they do not
  bool is_camera = false;  ///< odometry of the camera itself (truth, visual): no wheels
};

struct Sequence {
  std::filesystem::path root;  ///< a folder or a file, or what a stream is called
  std::vector<SequencePair> pairs;
  std::shared_ptr<const ImageSource> images;  ///< of `pairs`; null of a stream
  /// Where nothing is known beforehand of what comes: `pairs` is empty, and it is read once.
  std::shared_ptr<FrameStream> stream;
  int stamp_decimals =
      6;                ///< the most digits any colour stamp was written with: use them for output
  CameraConfig camera;  ///< complete, width and height included
  /// Depth to the pixels of `camera`; null where it is of these already.
  std::shared_ptr<const DepthRegistration> registration;
  std::string depth_camera_source;  ///< of the registration, for the log
  std::string camera_source;        ///< "calibration.txt", "preset TUM freiburg1", ...
  std::string_view likely_device;   ///< name of the one that camera.suspected_* are of; empty: none
  std::string shutter_source;  ///< where its shutter's times come from, for the log; empty: nowhere
  int colour_channels = 3;     ///< of the first readable colour image: 3, or 1 for grey recordings
  std::optional<std::filesystem::path> groundtruth;
  ListCounts counts;
  std::vector<SkippedImage> absent;   ///< listed files that do not exist and are in no pair
  std::size_t without_depth = 0;      ///< colour images that no depth image belongs to
  std::vector<std::string> warnings;  ///< one line each, for the log
  std::vector<std::string> notes;     ///< what the input was taken for, the same
  /// Of a bag or stream: sensor_msgs/Imu; nav_msgs/Odometry, the likeliest of wheels first.
  std::vector<MotionTopic> imu_topics, odometry_topics;
  /// Of what /tf moves, "/tf:child": odometry for who asks for it by this name.
  std::vector<MotionTopic> moving_frames;

  /// Of the depth images as they are stored.
  [[nodiscard]] const CameraConfig& depth_camera() const {
    return registration ? registration->depth_camera() : camera;
  }
  /// Where an image lies, for messages.
  [[nodiscard]] std::string place_of(const std::string& image) const {
    return image.starts_with('/') ? root.string() + ": " + image : (root / image).string();
  }
};

}  // namespace ygslam
