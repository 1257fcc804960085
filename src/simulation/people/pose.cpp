#include "simulation/people/pose.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam::sim {

namespace {

/// Axes along a bone and about its hinge.
Mat3 bone_frame(const Vec3& direction, const Vec3& hinge) {
  const Vec3 d = direction.normalized();
  const Vec3 h = (hinge - d * d.dot(hinge)).normalized();
  Mat3 frame;
  frame << d, h, d.cross(h);
  return frame;
}

Bone next(Bone bone) { return static_cast<Bone>(index(bone) + 1); }

}  // namespace

PoseBuilder::PoseBuilder(const BodyModel& model, const BodyShape& shape)
    : model_(model), shape_(shape), hips_(shape.joints[0]) {
  R_.fill(Mat3::Identity());
  local_.fill(Mat3::Identity());
}

void PoseBuilder::settle() {
  for (std::size_t b = 1; b < kBones; ++b) {
    if (!fixed_[b]) R_[b] = R_[static_cast<std::size_t>(model_.parent[b])] * local_[b];
  }
}

void PoseBuilder::set_hips(const Vec3& p_body, const Mat3& R) {
  hips_ = p_body;
  R_[0] = R;
  settle();
}

void PoseBuilder::turn(Bone bone, const Mat3& R_parent_bone) {
  local_[index(bone)] = R_parent_bone;
  fixed_[index(bone)] = false;
  settle();
}

void PoseBuilder::orient(Bone bone, const Mat3& R_body_bone) {
  R_[index(bone)] = R_body_bone;
  fixed_[index(bone)] = true;
  settle();
}

Vec3 PoseBuilder::joint(Bone bone) const {
  // Walk up to the hips, adding each bone's turned offset.
  Vec3 p = Vec3::Zero();
  std::size_t b = index(bone);
  while (model_.parent[b] >= 0) {
    const auto parent = static_cast<std::size_t>(model_.parent[b]);
    p += R_[parent] * (shape_.joints[b] - shape_.joints[parent]);
    b = parent;
  }
  return p + hips_;
}

double PoseBuilder::length(Bone from, Bone to) const {
  return (shape_.joints[index(to)] - shape_.joints[index(from)]).norm();
}

void PoseBuilder::reach(Bone upper, const Vec3& p_end_body, const Vec3& pole_body) {
  const Bone lower = next(upper);
  const Bone end = next(lower);
  const bool leg = upper == Bone::kLeftThigh || upper == Bone::kRightThigh;
  const double a = length(upper, lower);
  const double b = length(lower, end);
  const Vec3 root = joint(upper);
  Vec3 way = p_end_body - root;
  const double distance = std::clamp(way.norm(), std::abs(a - b) + 1e-3, 0.9995 * (a + b));
  const Vec3 n = way.normalized();
  const Vec3 pole = (pole_body - n * n.dot(pole_body)).normalized();
  const double cosine =
      std::clamp((a * a + distance * distance - b * b) / (2 * a * distance), -1.0, 1.0);
  const Vec3 middle = root + a * (cosine * n + std::sqrt(1 - cosine * cosine) * pole);
  const Vec3 hinge = n.cross(-pole);
  const Vec3 rest_pole = leg ? Vec3::UnitX() : Vec3(-Vec3::UnitX());
  const auto rest = [&](Bone from, Bone to) -> Mat3 {
    const Vec3 direction = shape_.joints[index(to)] - shape_.joints[index(from)];
    return bone_frame(direction, direction.cross(-rest_pole));
  };
  orient(upper, bone_frame(middle - root, hinge) * rest(upper, lower).transpose());
  orient(lower, bone_frame(root + distance * n - middle, hinge) * rest(lower, end).transpose());
}

BodyPose PoseBuilder::finish(const SE3& T_world_body) const {
  BodyPose pose;
  pose.T_world_body = T_world_body;
  pose.R = R_;
  pose.joints[0] = hips_;
  for (std::size_t b = 1; b < kBones; ++b) {
    const auto parent = static_cast<std::size_t>(model_.parent[b]);
    pose.joints[b] = pose.joints[parent] + R_[parent] * (shape_.joints[b] - shape_.joints[parent]);
  }
  return pose;
}

void skin(const BodyModel& model, const BodyShape& shape, const BodyPose& pose,
          std::vector<Vec3f>& p_world) {
  std::array<Eigen::Matrix<float, 3, 4>, kBones> world_from_rest;
  for (std::size_t b = 0; b < kBones; ++b) {
    const Mat3 R = pose.T_world_body.R() * pose.R[b];
    const Vec3 t = pose.T_world_body * pose.joints[b] - R * shape.joints[b];
    world_from_rest[b].leftCols<3>() = (R / 255.0).cast<float>();
    world_from_rest[b].col(3) = (t / 255.0).cast<float>();
  }
  p_world.resize(shape.points.size());
  for (std::size_t i = 0; i < p_world.size(); ++i) {
    const BodyModel::Weights& w = model.weights[i];
    Eigen::Matrix<float, 3, 4> blend = static_cast<float>(w.share[0]) * world_from_rest[w.bone[0]];
    for (int k = 1; k < 4 && w.share[k] > 0; ++k) {
      blend += static_cast<float>(w.share[k]) * world_from_rest[w.bone[k]];
    }
    p_world[i] = blend.leftCols<3>() * shape.points[i] + blend.col(3);
  }
}

void smooth_normals(const std::vector<Triangle>& triangles, const std::vector<std::uint32_t>& twin,
                    const std::vector<Vec3f>& p_world, std::vector<Vec3f>& normals) {
  normals.assign(p_world.size(), Vec3f::Zero());
  for (const Triangle& triangle : triangles) {
    const auto& [a, b, c] = triangle.corner;
    const Vec3f area = (p_world[b] - p_world[a]).cross(p_world[c] - p_world[a]);
    for (const std::uint32_t corner : triangle.corner) normals[twin[corner]] += area;
  }
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (twin[i] != i) {
      normals[i] = normals[twin[i]];  // twins come after their first
      continue;
    }
    const float length = normals[i].norm();
    normals[i] = length > 1e-12F ? Vec3f(normals[i] / length) : Vec3f::UnitZ();
  }
}

}  // namespace ygslam::sim
