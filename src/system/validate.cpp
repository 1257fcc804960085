#include <cstdio>

#include "core/memory.hpp"
#include "segment/movable.hpp"
#include "system/parts.hpp"
#include "system/slam_config.hpp"

namespace ygslam {

Status validate(const SlamConfig& config) {
  ConfigFaults faults;
  SlamConfig copy = config;
  const ConfigSchema schema = schema_of(copy);
  for (const ConfigKey& key : schema.keys()) {
    if (!key.set(key.get())) faults.add(key.name + " = '" + key.get() + "' is not in " + key.range);
  }
  const auto require = [&](bool fine, const char* rule) {
    if (!fine) faults.add(rule);
  };
  const SlamConfig& c = config;
  require(c.depth.min_m < c.depth.max_m, "depth.min_m must be less than depth.max_m");
  require(c.segment.network.input_width % 32 == 0, "segment.input_width must be a multiple of 32");
  require(c.segment.network.input_height % 32 == 0,
          "segment.input_height must be a multiple of 32");
  require(c.tracking.judge.weak_position_std_m <= c.tracking.judge.lost_position_std_m,
          "tracking.weak_position_std_m must not exceed tracking.lost_position_std_m");
  require(c.dense.plan.low_m < c.dense.plan.high_m,
          "dense.plan_low_m must be less than dense.plan_high_m");
  if (const auto movable = MovableClasses::of_names(c.segment.movable); !movable.ok())
    faults.add("segment.movable: " + movable.error().message);
  for (const std::string& part : c.run.without)
    if (const Status known = leave_out(part, copy); !known.ok())
      faults.add("run.without: " + known.error().message);
  return faults.status();
}

Status fits_in_memory(const DenseMapConfig& dense) {
  const Vec3 room_m(6, 8, 2.7);
  const double bytes = estimated_bytes(dense.volume, room_m);
  const double default_bytes = estimated_bytes(VolumeConfig{}, room_m);
  // What is seen may be less than a room: the default is let through everywhere.
  if (!dense.enabled || bytes <= default_bytes || can_allocate(static_cast<std::size_t>(bytes)))
    return Ok{};
  char text[256];
  std::snprintf(text, sizeof text,
                "dense.voxel_m %g: the dense map of a furnished room of 6 x 8 x 2.7 m would take "
                "%.1f GB, more memory than there is; with %g it takes %.1f GB",
                dense.volume.surface.voxel_m, 1e-9 * bytes, VolumeConfig{}.surface.voxel_m,
                1e-9 * default_bytes);
  return Error{ErrorKind::kConfig, text};
}

}  // namespace ygslam
