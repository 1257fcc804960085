#include "frame_input.hpp"

#include <nanobind/ndarray.h>

#include <Eigen/Geometry>

namespace nb = nanobind;

namespace ygslam::python {
namespace {

template <typename T>
using In = nb::ndarray<const T, nb::device::cpu>;

template <typename T>
bool is_array(const nb::object& object, In<T>& array) {
  return !object.is_none() && nb::try_cast(object, array, false);
}

[[noreturn]] void refuse_type(const std::string& what) { throw nb::type_error(what.c_str()); }
[[noreturn]] void refuse_value(const std::string& what) { throw nb::value_error(what.c_str()); }

template <typename T>
std::string shape_of(const In<T>& array) {
  std::string text;
  for (std::size_t i = 0; i < array.ndim(); ++i)
    text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  return "(" + text + (array.ndim() == 1 ? ",)" : ")");
}

/// What came in place of an array of the right kind.
std::string kind_of(const nb::object& object) {
  if (object.is_none()) return "None";
  const nb::object shown = nb::hasattr(object, "dtype")
                               ? nb::object(object.attr("dtype"))
                               : nb::object(object.type().attr("__name__"));
  return (nb::hasattr(object, "dtype") ? "an array of " : "") + std::string(nb::str(shown).c_str());
}

std::string text_of(ImageSize size, std::size_t channels) {
  const std::string pixels = "(" + std::to_string(size.height) + ", " + std::to_string(size.width);
  return pixels + (channels > 1 ? ", 3)" : ")");
}

/// Rows may be apart; what is in them is not. @return bytes from row to row.
template <typename T>
std::size_t row_stride(const In<T>& image, ImageSize size, std::size_t channels, const char* name,
                       const char* kind) {
  const std::size_t dimensions = channels > 1 ? 3 : 2;
  if (image.ndim() != dimensions)
    refuse_type(std::string(name) + ": an array of " + kind + " with " +
                std::to_string(dimensions) + " dimensions is expected, not of shape " +
                shape_of(image));
  if (image.shape(0) != size.height || image.shape(1) != size.width ||
      (channels > 1 && image.shape(2) != channels))
    refuse_value(std::string(name) + ": shape " + text_of(size, channels) +
                 " is expected, as the camera has it, not " + shape_of(image));
  const auto row = static_cast<std::int64_t>(image.shape(1) * channels);
  if (channels > 1 && image.stride(2) == -1)
    refuse_type(std::string(name) +
                ": channels that are turned round by a view; give the array as it is, and order");
  const bool is_packed = image.stride(1) == static_cast<std::int64_t>(channels) &&
                         (channels == 1 || image.stride(2) == 1) && image.stride(0) >= row;
  if (!is_packed)
    refuse_type(std::string(name) + ": rows that are contiguous and in order are expected, of " +
                kind + " (numpy.ascontiguousarray)");
  return static_cast<std::size_t>(image.stride(0)) * sizeof(T);
}

api::ColourOrder order_of(const std::string& name) {
  if (name == "rgb") return api::ColourOrder::kRgb;
  if (name == "bgr") return api::ColourOrder::kBgr;
  if (name == "mono") return api::ColourOrder::kMono;
  refuse_value("order: rgb, bgr or mono is expected, not " + name);
}

void take_colour(const FrameArguments& arguments, ImageSize size, api::Frame& frame) {
  In<std::uint8_t> rgb;
  if (!is_array(arguments.rgb, rgb))
    refuse_type("rgb: an array of uint8 is expected, not " + kind_of(arguments.rgb));
  frame.colour = order_of(arguments.order);
  const std::size_t channels = frame.colour == api::ColourOrder::kMono ? 1 : 3;
  frame.colour_stride = row_stride(rgb, size, channels, "rgb", "uint8");
  frame.rgb = rgb.data();
}

void take_depth(const FrameArguments& arguments, ImageSize size, api::Frame& frame) {
  In<float> metres;
  In<std::uint16_t> raw;
  if (is_array(arguments.depth, raw)) {
    frame.depth_stride = row_stride(raw, size, 1, "depth", "uint16");
    if (!(arguments.depth_scale > 0 && arguments.depth_scale < 1e12))
      refuse_value("depth_scale: units per metre, above 0, is expected with uint16");
    frame.depth_raw = raw.data();
    frame.depth_scale = arguments.depth_scale;
  } else if (is_array(arguments.depth, metres)) {
    frame.depth_stride = row_stride(metres, size, 1, "depth", "float32");
    if (arguments.depth_scale != 0 && arguments.depth_scale != 1)
      refuse_value("depth_scale: is for uint16; float32 is in metres");
    frame.depth_m = metres.data();
  } else {
    refuse_type("depth: an array of float32 [m] or uint16 is expected, not " +
                kind_of(arguments.depth));
  }
}

void take_instances(const FrameArguments& arguments, ImageSize size, api::Frame& frame) {
  if (arguments.classes.size() != arguments.scores.size() && !arguments.scores.empty())
    refuse_value("scores: as many as classes are expected, or none");
  for (std::size_t i = 0; i < arguments.classes.size(); ++i)
    frame.instances.push_back(
        {arguments.classes[i], arguments.scores.empty() ? 1.0F : arguments.scores[i]});
  if (arguments.instances.is_none()) return;
  In<std::uint8_t> ids;
  if (!is_array(arguments.instances, ids)) refuse_type("instances: an array of uint8 is expected");
  frame.instance_stride = row_stride(ids, size, 1, "instances", "uint8");
  frame.instance_ids = ids.data();
}

}  // namespace

api::Frame frame_of(const FrameArguments& arguments, ImageSize colour, ImageSize depth) {
  api::Frame frame;
  frame.t_ns = arguments.t_ns;
  frame.depth_t_ns = arguments.depth_t_ns;
  take_colour(arguments, colour, frame);
  take_depth(arguments, depth, frame);
  take_instances(arguments, colour, frame);
  if (!arguments.T_last_camera.is_none())
    frame.T_last_camera = pose_of(arguments.T_last_camera, "T_last_camera");
  return frame;
}

api::Pose pose_of(const nb::object& matrix, const char* name) {
  nb::ndarray<const double, nb::shape<4, 4>, nb::c_contig, nb::device::cpu> array;
  if (!nb::try_cast(matrix, array, false))
    refuse_type(std::string(name) + ": a C-contiguous array of float64, (4, 4), is expected");
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(array.data());
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  constexpr double kNotOne = 1e-3;
  const bool is_pose = T.allFinite() && T.row(3) == Eigen::RowVector4d(0, 0, 0, 1) &&
                       (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < kNotOne &&
                       R.determinant() > 0;
  if (!is_pose) refuse_value(std::string(name) + ": is no rotation and translation");
  const Eigen::Quaterniond q = Eigen::Quaterniond(R).normalized();
  return {{T(0, 3), T(1, 3), T(2, 3)}, {q.x(), q.y(), q.z(), q.w()}};
}

}  // namespace ygslam::python
