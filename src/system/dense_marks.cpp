#include "system/dense_marks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/check.hpp"

namespace ygslam {
namespace {

constexpr int kPointRadius_px = 20;
constexpr float kPointDepthRatio = 0.08F;

/// What stands about, among what the mask shows.
void add_things(const Segmentation& masks, const MovableClasses& movable, DenseFrame& dense) {
  const auto is_movable = movable_ids(masks, movable);
  std::array<std::uint8_t, 256> number{};
  for (std::size_t i = 0; i < masks.instances.size() && i + 1 < number.size(); ++i) {
    const Instance& instance = masks.instances[i];
    if (is_movable[i + 1] || dense.detections.size() >= kMaxDetections) continue;
    dense.detections.push_back({coco_class(instance.class_id), instance.score});
    number[i + 1] = static_cast<std::uint8_t>(dense.detections.size());
  }
  dense.edge_px = masks.edge_px;
  dense.things = GreyImage(masks.ids.width(), masks.ids.height());
  std::transform(masks.ids.begin(), masks.ids.end(), dense.things.begin(),
                 [&](std::uint8_t id) { return number[id]; });
}

Eigen::Vector2i pixel_of(const Feature& feature) {
  return {static_cast<int>(std::lround(feature.uv_px.x())),
          static_cast<int>(std::lround(feature.uv_px.y()))};
}

/// One point that is wrongly seen to move, beside somebody who walks, marks all of a small thing:
/// so those that stand still are asked, too.
std::vector<MotionVotes> motion_votes(const DenseFrame& dense, const Features& features,
                                      std::span<const MotionLabel> labels) {
  std::vector<MotionVotes> votes(dense.detections.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const Eigen::Vector2i at = pixel_of(features.points[i]);
    const std::uint8_t thing = dense.things.at(at.x(), at.y());
    if (thing == 0 || labels[i] == MotionLabel::kUnknown) continue;
    MotionVotes& vote = votes[thing - 1U];
    ++(labels[i] == MotionLabel::kDynamic ? vote.moving : vote.standing);
  }
  return votes;
}

/// Adds the surface around every dynamic point: what is near in the image and as far away.
void paint_dynamic_points(GreyImage& mask, const DepthImage& depth_m, const Features& features,
                          std::span<const MotionLabel> labels) {
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const float point_m = features.points[i].depth_m;
    if (labels[i] != MotionLabel::kDynamic || point_m <= 0) continue;
    const Eigen::Vector2i at = pixel_of(features.points[i]);
    for (int v = std::max(0, at.y() - kPointRadius_px);
         v <= std::min(mask.height() - 1, at.y() + kPointRadius_px); ++v) {
      for (int u = std::max(0, at.x() - kPointRadius_px);
           u <= std::min(mask.width() - 1, at.x() + kPointRadius_px); ++u) {
        if (std::abs(depth_m.at(u, v) - point_m) <= kPointDepthRatio * point_m) mask.at(u, v) = 255;
      }
    }
  }
}

}  // namespace

void mark_movers_and_things(const Segmentation* masks, const Features& features,
                            std::span<const MotionLabel> labels, const MovableClasses& movable,
                            DenseFrame& dense) {
  const DepthImage& depth_m = dense.frame->depth_m;
  dense.movers = GreyImage(depth_m.width(), depth_m.height());
  if (masks) {
    CHECK(masks->ids.same_size(dense.movers));
    dense.movers = movable_mask(*masks, movable);
    add_things(*masks, movable, dense);
    dense.motion_votes = motion_votes(dense, features, labels);
  }
  paint_dynamic_points(dense.movers, depth_m, features, labels);
}

}  // namespace ygslam
