#pragma once

#include "core/parallel.hpp"

namespace ygslam::sim {

using ygslam::parallel_for;

}  // namespace ygslam::sim
