// A sequence out of an MCAP stream: a camera that is running, a recording in a pipe.
#pragma once

#include "bag/bag_sequence.hpp"
#include "bag/byte_stream.hpp"
#include "bag/motion_beside.hpp"

namespace ygslam {

/// Reads as far as it takes to know topics and camera; those frames are not lost. The rest is read
/// by the sequence's FrameStream. Topics are chosen as those of a bag among what has come by then:
/// an image of every topic that was announced, and what is wanted besides, two seconds at most.
/// @param cameras in place of the stream's CameraInfo.
/// @return kInput: no MCAP, no images or several topics of them, none with depth. kConfig: no
/// usable camera.
[[nodiscard]] Result<Sequence> open_stream_sequence(ByteStream bytes, const BagTopics& topics,
                                                    const GivenCameras& cameras,
                                                    const WantedMotion& wanted = {});

}  // namespace ygslam
