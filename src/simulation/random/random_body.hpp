// People as nobody drew them: mixtures of the baked bodies in random clothes, a posture per shot.
#pragma once

#include <memory>
#include <vector>

#include "core/rng.hpp"
#include "simulation/people/pose.hpp"
#include "simulation/render/scene.hpp"

namespace ygslam::sim {

/// A body of its own: shape and clothes, with what is worn on it (skirt, hat, bag).
struct RandomFigure {
  BodyModel model;  ///< one shape; more vertices than the baked ones where something is worn
  Mesh topology;    ///< triangles with materials, texture coordinates; no points
  double height_m = 0;
};

/// Draws a body between and beyond the baked ones, grown-ups and children, and dresses it.
[[nodiscard]] RandomFigure random_figure(const BodyModel& baked, MaterialLibrary& materials,
                                         Rng& rng);

/// What somebody wears above the hips, hung up: without a body in it. In the frame of a hook on a
/// wall that faces -y.
[[nodiscard]] Mesh hung_coat(const BodyModel& baked, MaterialLibrary& materials, Rng& rng);

/// Shows the figure in a pose of its own in every shot; shot i lasts from i to i + 1 s.
class RandomBody : public DeformingBody {
 public:
  RandomBody(std::shared_ptr<const RandomFigure> figure, std::vector<BodyPose> poses)
      : figure_(std::move(figure)), poses_(std::move(poses)) {}

  [[nodiscard]] const Mesh& topology() const override { return figure_->topology; }
  void shape_at(double t_s, std::vector<Vec3f>& p_world,
                std::vector<Vec3f>& normals) const override;
  [[nodiscard]] SE3 T_world_root(double t_s) const override;

 private:
  [[nodiscard]] const BodyPose& pose_at(double t_s) const;

  std::shared_ptr<const RandomFigure> figure_;
  std::vector<BodyPose> poses_;
};

}  // namespace ygslam::sim
