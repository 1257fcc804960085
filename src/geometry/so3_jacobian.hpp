// How small changes of a rotation vector turn.
#pragma once

#include "geometry/se3.hpp"

namespace ygslam {

/// Left Jacobian of SO(3) (Barfoot 2017, eq. 7.77b), |omega| < 2 pi; its transpose is the right
/// one: so3_exp(omega + d) = so3_exp(J d) so3_exp(omega) = so3_exp(omega) so3_exp(J^T d), to first
/// order.
[[nodiscard]] Mat3 so3_left_jacobian(const Vec3& omega);

}  // namespace ygslam
