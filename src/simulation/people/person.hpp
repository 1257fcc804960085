// A person: a body shape with clothes who follows a plan.
#pragma once

#include <memory>
#include <vector>

#include "simulation/people/footsteps.hpp"
#include "simulation/people/pose.hpp"
#include "simulation/people/timeline.hpp"
#include "simulation/render/scene.hpp"

namespace ygslam::sim {

/// While it lasts the person holds something in front with both hands.
struct HoldingTime {
  double from_s = 0, until_s = 0;
  bool pushes =
      false;  ///< hands low and far, on the back of a chair; else carried before the chest
};

class Person : public DeformingBody {
 public:
  /// @param materials paints the clothes. @param seed of the person's small movements.
  Person(std::shared_ptr<const BodyModel> model, const PersonPlan& plan, std::uint64_t seed,
         std::vector<HoldingTime> holding, MaterialLibrary& materials);

  [[nodiscard]] const Mesh& topology() const override { return mesh_; }
  void shape_at(double t_s, std::vector<Vec3f>& p_world,
                std::vector<Vec3f>& normals) const override;
  [[nodiscard]] SE3 T_world_root(double t_s) const override;

  [[nodiscard]] BodyPose pose_at(double t_s) const;
  /// Body frame on the floor: what is pushed or carried hangs on it.
  [[nodiscard]] SE3 T_world_body(double t_s) const;
  [[nodiscard]] const Footsteps& footsteps() const { return footsteps_; }
  [[nodiscard]] const Timeline& timeline() const { return timeline_; }

 private:
  void place_feet(PoseBuilder& pose, const SE3& T_world_body, const FootState& left,
                  const FootState& right) const;
  void place_trunk(PoseBuilder& pose, const SE3& T_world_body, double t_s, const SitState& sit,
                   const FootState& left, const FootState& right) const;
  void place_arms(PoseBuilder& pose, double t_s, double local_s, const SitState& sit,
                  double stride_m) const;
  [[nodiscard]] Vec3 hand_target(int side, const std::string& gesture, double t_s) const;
  [[nodiscard]] const BodyShape& shape() const { return model_->shapes[shape_]; }

  std::shared_ptr<const BodyModel> model_;
  std::size_t shape_;
  Timeline timeline_;
  Footsteps footsteps_;
  std::vector<HoldingTime> holding_;
  double phase_;  // of the person's own small rhythms
  Mesh mesh_;     // topology with materials
};

}  // namespace ygslam::sim
