#include "system/parts.hpp"

#include <algorithm>
#include <array>

namespace ygslam {
namespace {

struct Part {
  const char* name;
  void (*leave_out)(SlamConfig&);
};

constexpr std::array kParts = {
    // F and the camera's motion from all points, not from those static before.
    Part{"static_prior", [](SlamConfig& c) { c.dynamic.epipolar.prior = false; }},
    Part{"ego_motion", [](SlamConfig& c) { c.dynamic.ego_motion.enabled = false; }},
    Part{"occlusion_boundaries", [](SlamConfig& c) { c.dynamic.boundary.enabled = false; }},
    Part{"neighbour_votes", [](SlamConfig& c) { c.dynamic.classifier.vote_of_neighbours = false; }},
    Part{"neighbour_support", [](SlamConfig& c) { c.dynamic.classifier.min_moving_share = 0; }},
    Part{"free_space", [](SlamConfig& c) { c.tracking.free_space.enabled = false; }},
    Part{"ego_mask", [](SlamConfig& c) { c.tracking.ego_mask.enabled = false; }},
    Part{"screens", [](SlamConfig& c) { c.tracking.screens.enabled = false; }},
    Part{"depth_edge_weights", [](SlamConfig& c) { c.mapping.noise.edge_weight = 1; }},
    Part{"local_map", [](SlamConfig& c) { c.tracking.pose.use_local_map = false; }},
    // At most three frames in a row go on with the features of the one before.
    Part{"orb_in_every_frame", [](SlamConfig& c) { c.tracking.follow.max_frames = 3; }},
    Part{"fallback_network", [](SlamConfig& c) { c.segment.fallback = false; }},
    Part{"submaps", [](SlamConfig& c) { c.tracking.starts_submaps = false; }},
    Part{"loops", [](SlamConfig& c) { c.close_loops = c.tracking.starts_submaps = false; }},
    Part{"dense_map", [](SlamConfig& c) { c.dense.enabled = false; }},
    Part{"local_bundle", [](SlamConfig& c) { c.mapping.local_bundle = false; }},
};

}  // namespace

std::string part_names() {
  std::string names;
  for (const Part& part : kParts) names += (names.empty() ? "" : ", ") + std::string(part.name);
  return names;
}

Status leave_out(const std::string& name, SlamConfig& config) {
  const auto* part =
      std::find_if(kParts.begin(), kParts.end(), [&](const Part& p) { return name == p.name; });
  if (part == kParts.end())
    return Error{ErrorKind::kConfig, "no part '" + name + "'; there are " + part_names()};
  part->leave_out(config);
  return Ok{};
}

}  // namespace ygslam
