// A pose to be kept by the thousands: 56 bytes.
#pragma once

#include <array>

#include "geometry/se3.hpp"

namespace ygslam {

struct PackedPose {
  std::array<double, 4> q_xyzw{0, 0, 0, 1};
  std::array<double, 3> t{};

  PackedPose() = default;
  explicit PackedPose(const SE3& T) : t{T.t().x(), T.t().y(), T.t().z()} {
    const Eigen::Quaterniond q = T.quaternion();
    q_xyzw = {q.x(), q.y(), q.z(), q.w()};
  }
  [[nodiscard]] SE3 unpacked() const {
    return {Eigen::Quaterniond(q_xyzw[3], q_xyzw[0], q_xyzw[1], q_xyzw[2]), Vec3(t[0], t[1], t[2])};
  }
};

}  // namespace ygslam
