// The topics of a run, and the type of the messages of each.
#pragma once

#include <array>
#include <cstddef>

#include "bag/ros_messages.hpp"

namespace ygslam {

struct Topic {
  const char* name;
  const char* type;
};

/// All a run may tell of, those of the mesh last.
inline constexpr std::array kRunTopics = {
    Topic{"/tf", ros::TfMessage::kType},
    Topic{"/odometry", ros::Odometry::kType},
    Topic{"/camera/image/compressed", ros::CompressedImage::kType},
    Topic{"/camera/camera_info", ros::CameraInfo::kType},
    Topic{"/camera/annotations", ros::ImageAnnotations::kType},
    Topic{"/objects", ros::MarkerArray::kType},
    Topic{"/state", ros::DiagnosticArray::kType},
    Topic{"/landmarks", ros::PointCloud2::kType},
    Topic{"/path", ros::Path::kType},
    Topic{"/loops", ros::MarkerArray::kType},
    Topic{"/cloud", ros::PointCloud2::kType},
    Topic{"/history", ros::PointCloud2::kType},
    Topic{"/floor", ros::TfMessage::kType},
    Topic{"/mesh", ros::MarkerArray::kType},
    Topic{"/mesh/classes", ros::MarkerArray::kType},
};
inline constexpr std::size_t kMeshTopics = 3;  // the last ones, the floor's included

}  // namespace ygslam
