#include "tracking/object_view.hpp"

#include "tracking/own_parts.hpp"

namespace ygslam {

ObjectInput object_input(const ObservedFrame& now, const PointClassifier& classifier,
                         const Camera& camera, const CameraPlace& place, const PixelMaskPtr& own) {
  const auto motion = classifier.motion_of(now.evidence);
  const auto links = classifier.reliable_links(now.evidence);
  ObjectInput input{now.seen.frame->id,
                    now.seen.frame->stamp,
                    place.T_odom_camera.inverse(),
                    place.T_world_odom,
                    {},
                    make_thumbnail(*now.seen.frame),
                    {}};
  for (const SegmentationPtr& masks : now.masks)
    if (uses_masks(classifier.config().mode)) input.masks.push_back(without_own_parts(masks, own));
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const Feature& feature = now.seen.features->points[i];
    const Vec3 p_cam = camera.unproject(feature.ideal_px.cast<double>(), feature.depth_m);
    input.points.push_back({feature.uv_px, feature.depth_m, place.T_odom_camera * p_cam, links[i],
                            motion[i] == PointMotion::kMoves, motion[i] == PointMotion::kStands});
  }
  return input;
}

}  // namespace ygslam
