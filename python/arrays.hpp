// NumPy arrays: some own what they hold, others are views of an object that they keep alive.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <array>
#include <initializer_list>
#include <vector>
#include <ygslam/slam.hpp>

namespace ygslam::python {

template <typename T, long Columns>
using Rows = nanobind::ndarray<nanobind::numpy, T, nanobind::shape<-1, Columns>>;
using Matrix4 = nanobind::ndarray<nanobind::numpy, double, nanobind::shape<4, 4>>;

template <typename Array, typename T>
[[nodiscard]] Array make_array(std::vector<T> values, std::initializer_list<std::size_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  const nanobind::capsule owner(kept,
                                [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return Array(kept->data(), shape, owner);
}

[[nodiscard]] Matrix4 to_matrix(const api::Pose& pose);
/// Rows of seconds, x, y, z, qx, qy, qz, qw, as in a TUM trajectory.
[[nodiscard]] Rows<double, 8> to_rows(const std::vector<api::StampedPose>& poses);

/// The three columns of T that stand at `first` of each element. @param owner keeps the list alive.
template <typename T, typename List>
[[nodiscard]] Rows<T, 3> columns_of(const List& list, T* first, nanobind::handle owner) {
  const auto stride = static_cast<std::int64_t>(sizeof(*list.data()) / sizeof(T));
  return Rows<T, 3>(first, {list.size(), 3}, owner, {stride, 1});
}

template <typename List>
[[nodiscard]] Rows<const float, 3> points_of(const List& cloud, nanobind::handle owner) {
  return columns_of<const float>(cloud, cloud.empty() ? nullptr : &cloud.data()->x_m, owner);
}
template <typename List>
[[nodiscard]] Rows<const std::uint8_t, 3> colours_of(const List& cloud, nanobind::handle owner) {
  return columns_of<const std::uint8_t>(cloud, cloud.empty() ? nullptr : &cloud.data()->r, owner);
}

}  // namespace ygslam::python
