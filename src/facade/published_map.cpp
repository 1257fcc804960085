#include "facade/published_map.hpp"

#include <utility>

#include "facade/convert.hpp"
#include "system/run_writer.hpp"

namespace ygslam::api {

void PublishedMap::show(const Map& map) {
  std::vector<StampedPose> keyframes;
  for (const ygslam::StampedPose& pose : keyframe_trajectory(map))
    keyframes.push_back({pose.stamp.ns, to_api(pose.T_world_camera)});
  std::vector<std::array<float, 3>> landmarks;
  landmarks.reserve(map.landmark_count());
  map.for_each_landmark([&](const Landmark& landmark) {
    const Eigen::Vector3f p = landmark.p_world.cast<float>();
    landmarks.push_back({p.x(), p.y(), p.z()});
  });
  sparse_.store(std::make_shared<const Sparse>(
      Sparse{SharedList(std::move(keyframes)), SharedList(std::move(landmarks))}));
}

MapSnapshot PublishedMap::map() const {
  const auto sparse = sparse_.load();
  return {sparse->keyframes, sparse->landmarks_world_m, room().mesh().vertices};
}

}  // namespace ygslam::api
