#include "mapping/late_shutter.hpp"

#include <cmath>

#include "features/attach.hpp"

namespace ygslam {
namespace {

constexpr double kSameTime_s = 1e-6;

struct Change {
  ReadOut was, now;
};

void bring_to_middle_again(Map& map, const Camera& camera, KeyframeId id, const Change& change) {
  auto data = std::make_shared<KeyframeData>(*map.keyframe(id).data);
  auto features = std::make_shared<Features>(*data->features);
  move_to_other_times(*features, camera, change.was, change.now);
  data->features = std::move(features);
  data->grid = FeatureGrid(*data->features, camera.ideal_bounds());
  data->read_out = change.now;
  map.set_data(id, std::move(data));
}

/// A landmark lies where its keyframes on average have it now.
void move_along(Map& map, const Camera& camera, LandmarkId id,
                const std::map<KeyframeId, Change>& changes) {
  const Landmark& landmark = map.landmark(id);
  Vec3 shift_world = Vec3::Zero();
  for (const LandmarkObservation& o : landmark.observations) {
    const auto change = changes.find(o.keyframe);
    if (change == changes.end()) continue;
    const Keyframe& keyframe = map.keyframe(o.keyframe);
    const double row_px = keyframe.data->features->points[o.feature].uv_px.y();
    const Vec3 p_cam = keyframe.T_camera_world * landmark.p_world;
    const RollingShutter before(camera.height(), change->second.was);
    const RollingShutter after(camera.height(), change->second.now);
    const Vec3 p_middle = after.to_middle(before.to_row(p_cam, row_px), row_px);
    shift_world += keyframe.T_camera_world.R().transpose() * (p_middle - p_cam);
  }
  map.set_position(
      id, landmark.p_world + shift_world / static_cast<double>(landmark.observations.size()));
  map.refresh(id);
}

}  // namespace

bool correct_shutter(Map& map, const Camera& camera, double was_s, const ShutterTimes& now) {
  std::map<KeyframeId, Change> changes;
  for (const auto& [id, keyframe] : map.keyframes()) {
    const ReadOut& read_out = keyframe.data->read_out;
    if (std::abs(read_out.times.colour_readout_s - was_s) > kSameTime_s) continue;
    const ShutterTimes times{now.colour_readout_s, now.depth_readout_s,
                             read_out.times.depth_delay_s};
    changes[id] = {read_out, {times, read_out.body_velocity}};
  }
  if (changes.empty()) return false;
  for (const auto& [id, change] : changes) bring_to_middle_again(map, camera, id, change);
  std::vector<LandmarkId> landmarks;
  map.for_each_landmark([&](const Landmark& landmark) { landmarks.push_back(landmark.id); });
  for (const LandmarkId id : landmarks) move_along(map, camera, id, changes);
  return true;
}

}  // namespace ygslam
