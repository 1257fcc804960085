// What is read of a trajectory and told, because it may be meant otherwise.
#pragma once

#include <string>
#include <vector>

#include "io/trajectory.hpp"
#include "io/trajectory_evidence.hpp"

namespace ygslam {

/// A file put together of two may have quaternions in two orders: where one turns far and would
/// hardly do so with its w at the other end, it is told once.
void warn_of_mixed_orders(const PoseText& text, const std::vector<StampedPose>& poses,
                          const std::string& name);
/// Where lines are not in order of their stamps, how many, and why that may be.
void warn_of_order(const PoseText& text, const std::vector<StampedPose>& poses,
                   const std::string& name);
/// Programs that write a pose for every frame write 0 0 0 0 0 0 1 where they are lost.
void warn_of_blanks(const std::vector<StampedPose>& poses, const std::string& name);

}  // namespace ygslam
