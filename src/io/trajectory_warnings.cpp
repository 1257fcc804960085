#include "io/trajectory_warnings.hpp"

#include <algorithm>
#include <numbers>
#include <set>

#include "core/log.hpp"

namespace ygslam {

void warn_of_mixed_orders(const PoseText& text, const std::vector<StampedPose>& poses,
                          const std::string& name) {
  constexpr double kLeap_deg = 30;
  constexpr double kStep_deg = 5;
  constexpr double kDegrees = 180 / std::numbers::pi;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Eigen::Quaterniond before = poses[i - 1].T_world_camera.quaternion();
    const Eigen::Quaterniond q = poses[i].T_world_camera.quaternion();
    const double turn_deg = kDegrees * before.angularDistance(q);
    if (turn_deg < kLeap_deg) continue;
    const Eigen::Quaterniond w_first(q.x(), q.y(), q.z(), q.w());
    const Eigen::Quaterniond w_last(q.z(), q.w(), q.x(), q.y());
    const double otherwise_deg =
        kDegrees * std::min(before.angularDistance(w_first), before.angularDistance(w_last));
    if (otherwise_deg > kStep_deg) continue;
    log::warn(
        "{}:{}: the pose turns by {:.0f} deg against the line before, with qw at the other end of "
        "the quaternion by {:.1f}: are there two orders of quaternions in this file?",
        name, text.records[i].line, turn_deg, otherwise_deg);
    return;
  }
}

void warn_of_order(const PoseText& text, const std::vector<StampedPose>& poses,
                   const std::string& name) {
  std::size_t moved = 0;
  for (std::size_t i = 1; i < poses.size(); ++i)
    moved += poses[i].stamp < poses[i - 1].stamp ? 1 : 0;
  if (moved == 0) return;
  std::set<std::size_t> digits;  // behind the point
  for (const PoseRecord& record : text.records) {
    const std::string_view stamp = record.fields[text.columns.stamp_at];
    if (const auto point = stamp.find('.'); point != std::string_view::npos)
      digits.insert(stamp.size() - point);
  }
  log::warn("{}: stamps go back in {} of {} lines: sorted by their stamps{}", name, moved,
            poses.size(),
            digits.size() > 1 ? " (fractions of other lengths: without their leading zeros?)" : "");
}

void warn_of_blanks(const std::vector<StampedPose>& poses, const std::string& name) {
  constexpr double kLeap_m = 0.05, kLeap_rad = 0.1;
  const auto is_blank = [](const SE3& T) { return T.t().isZero(0) && T.R().isIdentity(0); };
  std::size_t blanks = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const SE3& before = poses[i - 1].T_world_camera;
    const bool is_leap = before.t().norm() > kLeap_m || before.angle() > kLeap_rad;
    if (is_blank(poses[i].T_world_camera) && (is_leap || (blanks > 0 && is_blank(before))))
      ++blanks;
  }
  if (blanks > 0)
    log::warn("{}: {} poses leap to 0 0 0 0 0 0 1: frames without a pose? They are taken as poses",
              name, blanks);
}

}  // namespace ygslam
