#include "arrays.hpp"

namespace ygslam::python {

Matrix4 to_matrix(const api::Pose& pose) {
  const auto& [x, y, z, w] = pose.rotation_xyzw;
  const auto& t = pose.translation_m;
  return make_array<Matrix4>(
      std::vector<double>{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), t[0],
                          2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), t[1],
                          2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), t[2],
                          0, 0, 0, 1},
      {4, 4});
}

Rows<double, 8> to_rows(const std::vector<api::StampedPose>& poses) {
  std::vector<double> rows;
  rows.reserve(8 * poses.size());
  for (const api::StampedPose& pose : poses) {
    const auto& [t_ns, T] = pose;
    rows.push_back(static_cast<double>(t_ns) * 1e-9);
    rows.insert(rows.end(), T.translation_m.begin(), T.translation_m.end());
    rows.insert(rows.end(), T.rotation_xyzw.begin(), T.rotation_xyzw.end());
  }
  return make_array<Rows<double, 8>>(std::move(rows), {poses.size(), 8});
}

}  // namespace ygslam::python
