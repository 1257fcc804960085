#include "bag/ros_images.hpp"
#include "core/check.hpp"
#include "fuzz/targets.hpp"

namespace ygslam::fuzz {

void messages(std::string_view bytes) {
  if (bytes.empty()) return;
  const auto kind = static_cast<unsigned char>(bytes.front());
  const std::span<const std::uint8_t> content(
      reinterpret_cast<const std::uint8_t*>(bytes.data()) + 1, bytes.size() - 1);
  const Layout layout = (kind & 1) != 0 ? Layout::kRos1 : Layout::kCdr;
  const BagTopic topic{"/t", (kind & 2) != 0 ? ros::kCompressedType : ros::kImageType, layout};
  (void)ros::image_kind(topic, content);
  CameraConfig camera;
  camera.depth_scale = ros::kMillimetres;
  if (const auto header = ros::decode_header(topic, content); header.ok()) {
    const ImageSize size = header.value().size;
    const auto colour =
        ros::decode_colour(topic, content, size, header.value().channels == 1 ? 1 : 3);
    CHECK(!colour.ok() || colour.value().width() == size.width);
    camera.width = size.width;
    camera.height = size.height;
  }
  const auto depth_m = ros::decode_depth(topic, content, camera, {});
  if (depth_m.ok()) {
    CHECK(depth_m.value().width() == camera.width && depth_m.value().height() == camera.height);
    for (const float d : depth_m.value()) CHECK(d >= 0 && d <= 8, "in range or none");
  }
  ros::CameraInfo info;
  if (from_cdr(content, info, layout)) (void)ros::camera_of(info, (kind & 4) != 0);
}

}  // namespace ygslam::fuzz
