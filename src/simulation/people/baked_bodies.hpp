// The people that come with the project.
#pragma once

#include "simulation/people/body_model.hpp"

namespace ygslam::sim {

/// The six bodies of assets/bodies.bin, which is part of the library.
[[nodiscard]] Result<BodyModel> baked_bodies();

}  // namespace ygslam::sim
