// Images and cameras out of serialised messages of ROS 2.
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>

#include <array>
#include <memory>
#include <span>
#include <utility>
#include <ygslam/slam.hpp>

#include "bag/ros_images.hpp"
#include "bindings.hpp"
#include "calls.hpp"
#include "core/printable.hpp"
#include "io/depth_registration.hpp"

namespace nb = nanobind;

namespace ygslam::python {
namespace {

using Rgb = nb::ndarray<nb::numpy, std::uint8_t, nb::ndim<3>, nb::c_contig>;
using DepthM = nb::ndarray<nb::numpy, float, nb::ndim<2>, nb::c_contig>;

constexpr DepthConfig kAnyDepth = {0, 1000};  // the settings of the run decide

[[noreturn]] void fail(const Error& error, const std::string& what) {
  throw api::Error(static_cast<int>(error.kind), one_line(what + ": " + error.message));
}

std::span<const std::uint8_t> span_of(const nb::bytes& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.c_str()), bytes.size()};
}

/// "sensor_msgs/msg/Image" as bags call it.
BagTopic topic_of(const char* name, std::string type) {
  if (const std::size_t at = type.find("/msg/"); at != std::string::npos) type.erase(at, 4);
  if (type != ros::kImageType && type != ros::kCompressedType)
    fail({ErrorKind::kInput, type + " is no type of images"}, name);
  return {name, std::move(type), Layout::kCdr};
}

CameraConfig camera_of(const nb::bytes& message, const char* what) {
  ros::CameraInfo info;
  if (!from_cdr(span_of(message), info)) fail({ErrorKind::kInput, "the message ends early"}, what);
  const auto camera = ros::camera_of(info, false);
  if (!camera.ok()) fail(camera.error(), std::string(what) + ": the camera");
  return *camera;
}

class RosImages {
 public:
  RosImages(const nb::bytes& colour_info, const nb::bytes& depth_info,
            const std::array<double, 7>& place)
      : colour_(camera_of(colour_info, "camera info")), depth_(colour_) {
    if (depth_info.size() == 0) return;
    depth_ = camera_of(depth_info, "camera info of depth");
    const auto& [x, y, z, qx, qy, qz, qw] = place;
    const Eigen::Quaterniond rotation(qw, qx, qy, qz);
    registration_ =
        depth_registration({depth_, SE3(rotation.normalized(), Vec3(x, y, z))}, colour_);
  }

  [[nodiscard]] api::CameraModel camera() const {
    const CameraConfig& c = colour_;
    return {.fx = c.fx,
            .fy = c.fy,
            .cx = c.cx,
            .cy = c.cy,
            .k1 = c.k1,
            .k2 = c.k2,
            .p1 = c.p1,
            .p2 = c.p2,
            .k3 = c.k3,
            .width = c.width,
            .height = c.height};
  }

  [[nodiscard]] Rgb colour(const std::string& type, const nb::bytes& message) const {
    const BagTopic topic = topic_of("colour", type);
    const auto bytes = span_of(message);
    std::unique_ptr<ColourImage> image;
    {
      const Unlocked unlocked;
      const auto header = ros::decode_header(topic, bytes);
      if (!header.ok()) fail(header.error(), "colour");
      auto decoded = ros::decode_colour(topic, bytes, {colour_.width, colour_.height},
                                        header->channels == 1 ? 1 : 3);
      if (!decoded.ok()) fail(decoded.error(), "colour");
      image = std::make_unique<ColourImage>(std::move(decoded).value());
    }
    const std::size_t height = static_cast<std::size_t>(image->height());
    const std::size_t width = static_cast<std::size_t>(image->width());
    auto* pixels = reinterpret_cast<std::uint8_t*>(image->data());
    return Rgb(pixels, {height, width, 3}, owner_of(std::move(image)));
  }

  [[nodiscard]] DepthM depth(const std::string& type, const nb::bytes& message) const {
    const BagTopic topic = topic_of("depth", type);
    const auto bytes = span_of(message);
    std::unique_ptr<DepthImage> image;
    {
      const Unlocked unlocked;
      auto decoded = ros::decode_depth(topic, bytes, depth_, kAnyDepth);
      if (!decoded.ok()) fail(decoded.error(), "depth");
      image = std::make_unique<DepthImage>(registration_ ? registration_->registered(*decoded)
                                                         : std::move(decoded).value());
    }
    const std::size_t height = static_cast<std::size_t>(image->height());
    const std::size_t width = static_cast<std::size_t>(image->width());
    float* pixels = image->data();
    return DepthM(pixels, {height, width}, owner_of(std::move(image)));
  }

 private:
  template <typename Kept>
  static nb::capsule owner_of(std::unique_ptr<Kept> image) {
    return {image.release(), [](void* p) noexcept { delete static_cast<Kept*>(p); }};
  }

  CameraConfig colour_, depth_;
  std::shared_ptr<const DepthRegistration> registration_;
};

}  // namespace

void bind_ros_images(nb::module_& m) {
  nb::class_<RosImages>(m, "RosImages",
                        "Arrays for Slam.process() out of serialised (CDR) messages of ROS 2.")
      .def(nb::init<const nb::bytes&, const nb::bytes&, const std::array<double, 7>&>(),
           nb::arg("colour_info"), nb::arg("depth_info") = nb::bytes("", 0),
           nb::arg("T_colour_depth") = std::array<double, 7>{0, 0, 0, 0, 0, 0, 1},
           "colour_info, depth_info: sensor_msgs/msg/CameraInfo; without the second depth is that "
           "of the colour camera. T_colour_depth: x, y, z [m], qx, qy, qz, qw from the optical "
           "frame of the depth camera to that of the colour camera. ConfigError where a camera "
           "cannot be used.")
      .def_prop_ro("camera", &RosImages::camera, "of the colour images")
      .def("colour", &RosImages::colour, nb::arg("type"), nb::arg("message"),
           "type: sensor_msgs/msg/Image or CompressedImage. @return (H, W, 3) uint8. InputError "
           "where the message cannot be used.")
      .def("depth", &RosImages::depth, nb::arg("type"), nb::arg("message"),
           "The same, (H, W) float32 [m], 0 = none, as the colour camera sees it. compressedDepth "
           "is a CompressedImage, too.");
}

}  // namespace ygslam::python
