// NumPy arrays that own what they hold.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <initializer_list>
#include <vector>

namespace ygslam::python {

template <typename T>
using Array = nanobind::ndarray<nanobind::numpy, T, nanobind::c_contig>;

template <typename T>
[[nodiscard]] Array<T> make_array(std::vector<T> values, std::initializer_list<std::size_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  const nanobind::capsule owner(kept,
                                [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return Array<T>(kept->data(), shape, owner);
}

}  // namespace ygslam::python
