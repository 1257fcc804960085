// What the people wear.
#pragma once

#include "simulation/people/body_model.hpp"
#include "simulation/surface/materials.hpp"
#include "simulation/world/world_config.hpp"

namespace ygslam::sim {

/// The parts of the body that show, with their materials; points and normals stay empty.
[[nodiscard]] Mesh dressed(const BodyModel& model, const PersonPlan& plan,
                           MaterialLibrary& materials);

}  // namespace ygslam::sim
