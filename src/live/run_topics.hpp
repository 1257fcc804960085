// The topics of a run: which there are, and their messages for whoever wants them.
#pragma once

#include <array>
#include <cstddef>

#include "live/message_sink.hpp"
#include "live/run_messages.hpp"
#include "system/runner.hpp"

namespace ygslam {

struct Topic {
  const char* name;
  const char* type;
};

/// All a run may tell of, those of the map last.
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
};

void publish_frame(const RgbdFrame& frame, const TrackResult& result, const CameraConfig& camera,
                   MessageSink& sink);
/// @param most_points of the cloud.
void publish_map(Runner& runner, Timestamp stamp, std::size_t most_points, MessageSink& sink);
[[nodiscard]] bool wants_map(const MessageSink& sink);

}  // namespace ygslam
