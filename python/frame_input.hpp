// NumPy arrays as the library's frames: where they lie, for the time of a call.
#pragma once

#include <nanobind/nanobind.h>

#include <string>
#include <vector>
#include <ygslam/slam.hpp>

namespace ygslam::python {

/// As process() takes them.
struct FrameArguments {
  nanobind::object rgb, depth;
  std::int64_t t_ns = 0;
  double depth_scale = 0;
  std::int64_t depth_t_ns = 0;
  std::string order;
  nanobind::object instances;  ///< None: nobody looked
  std::vector<std::string> classes;
  std::vector<float> scores;
  nanobind::object T_last_camera;  ///< None: not known
};

struct ImageSize {
  std::size_t height = 0, width = 0;
};

/// Its pointers are good as long as the arrays live. @throws TypeError, ValueError
[[nodiscard]] api::Frame frame_of(const FrameArguments& arguments, ImageSize colour,
                                  ImageSize depth);
/// @param matrix (4, 4). @throws TypeError, ValueError where it is no pose.
[[nodiscard]] api::Pose pose_of(const nanobind::object& matrix, const char* name);

}  // namespace ygslam::python
