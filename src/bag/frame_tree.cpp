#include "bag/frame_tree.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

namespace ygslam {
namespace {

constexpr std::size_t kMostFrames = 10'000;
constexpr std::size_t kDeepest = 64;  // a chain of frames; also ends what goes in a circle

std::optional<SE3> rigid_motion(const ros::Pose& pose) {
  constexpr double kNormTolerance = 0.01;
  const auto& [x, y, z] = pose.position;
  const auto& q = pose.orientation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  const Vec3 t(x, y, z);
  if (!(std::abs(rotation.norm() - 1) < kNormTolerance) || !t.allFinite()) return std::nullopt;
  return SE3(rotation, t);
}

}  // namespace

std::string frame_name(const std::string& frame) {
  return cut_name(frame.starts_with('/') ? frame.substr(1) : frame);
}

bool are_other_frames(const std::string& a, const std::string& b) {
  return !a.empty() && !b.empty() && frame_name(a) != frame_name(b);
}

bool has_transforms(const BagTopic& topic) {
  return topic.type == "tf2_msgs/TFMessage" || topic.type == "tf/tfMessage";
}

void FrameTree::take(const BagTopic& topic, std::span<const std::uint8_t> bytes) {
  ros::TfMessage message;
  if (!from_cdr(bytes, message, topic.layout)) return;
  const bool is_static = topic.name.ends_with("tf_static");
  for (const ros::TransformStamped& transform : message.transforms) {
    const std::string child = frame_name(transform.child_frame_id);
    const auto known = edge_of_.find(child);
    if (known != edge_of_.end() && (known->second.is_static || !is_static)) continue;
    const auto motion = rigid_motion(transform.transform);
    if (!motion) continue;
    if (known == edge_of_.end() && edge_of_.size() >= kMostFrames) {
      left_out_ = true;
      continue;
    }
    edge_of_.insert_or_assign(child,
                              Edge{frame_name(transform.header.frame_id), *motion, is_static});
  }
}

Result<SE3> FrameTree::T_target_source(const std::string& target, const std::string& source,
                                       Trust trust) const {
  struct Ancestor {
    std::string frame;
    SE3 T_ancestor_start;
  };
  bool is_cut = false;
  const auto ancestors = [&](const std::string& start) {
    std::vector<Ancestor> line = {{frame_name(start), SE3()}};
    for (;;) {
      const auto up = edge_of_.find(line.back().frame);
      if (up == edge_of_.end() || (trust == Trust::kStatic && !up->second.is_static)) return line;
      if (line.size() == kDeepest) {
        is_cut = true;
        return line;
      }
      line.push_back({up->second.parent, up->second.T_parent_child * line.back().T_ancestor_start});
    }
  };
  const auto of_target = ancestors(target);
  for (const Ancestor& a : ancestors(source))
    for (const Ancestor& b : of_target)
      if (a.frame == b.frame) return b.T_ancestor_start.inverse() * a.T_ancestor_start;
  std::string missing = trust == Trust::kStatic ? "no transform between them on /tf_static"
                                                : "no transform between them";
  if (left_out_) missing += fmt::format(" among the first {} frames", kMostFrames);
  if (is_cut) missing += fmt::format(" in a chain of up to {}", kDeepest);
  return Error{ErrorKind::kInput, std::move(missing)};
}

}  // namespace ygslam
