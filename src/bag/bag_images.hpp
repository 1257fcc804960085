// What of a bag a sequence may be made of.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "bag/frame_tree.hpp"
#include "bag/motion_topics.hpp"
#include "bag/ros_images.hpp"
#include "io/sequence.hpp"

namespace ygslam {

struct BagImage {
  Timestamp stamp;
  MessagePlace place;
  std::size_t order = 0;  ///< among the images of all topics, as they were recorded
};

/// The messages of a topic with images.
struct ImageTopic {
  BagTopic topic;
  ros::ImageKind kind = ros::ImageKind::kOther;  ///< of the first that can be read
  std::string frame_id;
  std::string encoding;          ///< where it is none that is read
  std::vector<BagImage> images;  ///< in the order of the file
};

struct BagContent {
  std::vector<ImageTopic> images;
  /// The first message of each topic that is calibrated, else the first.
  std::map<std::string, ros::CameraInfo> cameras;
  std::set<std::string> changed_cameras;  ///< topics that say something else later
  FrameTree frames;
  MotionFrames motion;
  std::set<std::string> unread;  ///< topics with pictures of types that are not read, with these
  std::size_t too_many = 0;      ///< images that were left out
  bool has_messages = false;     ///< of whatever type
};

/// Collects the content of a bag, message by message.
class ContentReader {
 public:
  /// @param topic of the message.
  /// @return where an image that can be used was put: its place in content().images.
  std::optional<std::size_t> take(const BagTopic& topic, const BagMessage& message);
  [[nodiscard]] const BagContent& content() const { return content_; }

 private:
  BagContent content_;
  std::unordered_map<std::size_t, std::size_t> place_of_;  // of the bag's topic in images
  std::size_t image_count_ = 0;                            // of all topics
};

/// Reads through the bag. @return as Bag::visit().
[[nodiscard]] Result<BagContent> read_content(Bag& bag, const Bag::Interrupted& interrupted);

/// An image's stamp, of its header; where that is zero, when it was recorded.
[[nodiscard]] std::optional<Timestamp> image_stamp(const BagTopic& topic,
                                                   const BagMessage& message);
/// As it is listed and told in messages. @param number of its topic, from 0 on.
[[nodiscard]] ListedImage listed_image(const BagTopic& topic, Timestamp stamp, std::size_t number);

/// The topic of a kind: the one of that name, or the only one there is. Of the same image raw and
/// compressed, the raw one.
/// @param what "colour" or "depth". @param option that chooses, for messages.
/// @return kInput with a reason alone.
[[nodiscard]] Result<const ImageTopic*> choose_topic(const BagContent& content,
                                                     const std::string& name,
                                                     const std::string& what,
                                                     const std::string& option);

struct BagCamera {
  std::string topic;
  CameraConfig camera;
};
/// @return the camera and its topic; nothing where the bag tells none of these images.
/// kConfig with a reason alone: one that cannot be used, or several that may be meant.
[[nodiscard]] Result<std::optional<BagCamera>> camera_of(const BagContent& content,
                                                         const ImageTopic& colour);

struct BagDepthCamera {
  std::string topic;                  ///< of the CameraInfo
  std::optional<DepthCamera> camera;  ///< none: that of the colour images
  std::string missing;  ///< why depth of another frame cannot be registered; empty: nothing missing
};
/// The camera that takes the depth images, where it is another than the colour camera and the bag
/// tells so: a CameraInfo beside the depth topic with another size, or of a frame whose place is
/// known. Topics that call themselves registered or aligned are of the colour camera.
/// @param colour_size of the colour camera, 0 = as its CameraInfo says.
/// @return kConfig with a reason alone: one that cannot be used.
[[nodiscard]] Result<BagDepthCamera> depth_camera_of(const BagContent& content,
                                                     const ImageTopic& colour,
                                                     const ImageTopic& depth,
                                                     const ImageSize& colour_size);

/// The images of two topics, under names of their own.
class BagImages final : public ImageSource {
 public:
  explicit BagImages(std::unique_ptr<Bag> bag) : bag_(std::move(bag)) {}

  /// @return all images of a topic, in the order in which they were recorded.
  std::vector<ListedImage> add(const ImageTopic& topic);

  Result<ImageHeader> header(const std::string& name) const override;
  Result<ColourImage> colour(const std::string& name, const ImageSize& size,
                             int channels) const override;
  Result<DepthImage> depth_m(const std::string& name, const CameraConfig& camera,
                             const DepthConfig& config) const override;

 private:
  struct Place {
    std::size_t topic;
    MessagePlace place;
  };
  std::unique_ptr<Bag> bag_;
  std::vector<BagTopic> topics_;
  std::unordered_map<std::string, Place> place_of_;
};

}  // namespace ygslam
