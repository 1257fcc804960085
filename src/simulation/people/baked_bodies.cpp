#include "simulation/people/baked_bodies.hpp"

#include "simulation/embedded_files.hpp"
#include "simulation/world/world_config.hpp"

namespace ygslam::sim {

Result<BodyModel> baked_bodies() {
  const auto bytes = embedded_file("bodies.bin");
  CHECK(bytes.has_value(), "the library was built without its bodies");
  Result<BodyModel> model = parse_bodies(*bytes);
  if (!model) return model.error();
  CHECK(model->shapes.size() == kBodies, "kBodies is not the number of the baked ones");
  return model;
}

}  // namespace ygslam::sim
