// A body's pose and the means to make one: rotations down the skeleton, and limbs that reach.
#pragma once

#include <array>

#include "simulation/people/body_model.hpp"

namespace ygslam::sim {

/// How far every bone is turned away from the standing shape, in the body frame.
struct BodyPose {
  SE3 T_world_body;                 ///< body frame: on the floor below the person
  std::array<Mat3, kBones> R;       ///< turned part of the body frame, per bone
  std::array<Vec3, kBones> joints;  ///< body frame [m]
};

/// Builds a pose from the hips outwards.
class PoseBuilder {
 public:
  PoseBuilder(const BodyModel& model, const BodyShape& shape);

  /// Place of the hips in the body frame and turn of the pelvis.
  void set_hips(const Vec3& p_body, const Mat3& R);
  /// Turn of a bone against its parent, in axes of the body frame at rest.
  void turn(Bone bone, const Mat3& R_parent_bone);
  /// Turn of a bone in the body frame, whatever its parent does.
  void orient(Bone bone, const Mat3& R_body_bone);
  /// Puts the end of a limb of two bones at a place: thigh and shin, or arm and forearm.
  /// @param pole where knee or elbow points to. Out of reach: stretched towards the place.
  void reach(Bone upper, const Vec3& p_end_body, const Vec3& pole_body);

  [[nodiscard]] Vec3 joint(Bone bone) const;
  [[nodiscard]] const Mat3& rotation(Bone bone) const { return R_[index(bone)]; }
  [[nodiscard]] const BodyShape& shape() const { return shape_; }
  [[nodiscard]] double length(Bone from, Bone to) const;
  [[nodiscard]] BodyPose finish(const SE3& T_world_body) const;

 private:
  void settle();

  const BodyModel& model_;
  const BodyShape& shape_;
  Vec3 hips_;
  std::array<Mat3, kBones> R_;      // body frame
  std::array<Mat3, kBones> local_;  // against the parent
  std::array<bool, kBones> fixed_{};
};

/// Vertex positions in the world by linear blend skinning.
void skin(const BodyModel& model, const BodyShape& shape, const BodyPose& pose,
          std::vector<Vec3f>& p_world);

/// Unit normals of vertices, area-weighted; those at the same place share one.
/// @param twin of every vertex the first one at its place.
void smooth_normals(const std::vector<Triangle>& triangles, const std::vector<std::uint32_t>& twin,
                    const std::vector<Vec3f>& p_world, std::vector<Vec3f>& normals);

}  // namespace ygslam::sim
