#include "motion/masks/label_history.hpp"

#include <algorithm>
#include <utility>

namespace ygslam {

void LabelHistory::push(FrameId frame, FeaturesPtr features,
                        std::vector<std::int32_t> link_to_previous, std::span<const FlowEnd> ends,
                        const DepthImage& depth_m) {
  CHECK(features != nullptr && link_to_previous.size() == features->size());
  CHECK(ends.size() == (entries_.empty() ? 0 : entries_.back().features->size()));
  Entry entry;
  entry.frame = frame;
  entry.sequence = next_sequence_++;
  entry.features = std::move(features);
  entry.link = std::move(link_to_previous);
  entry.depth_m = CoarseDepth(depth_m);
  entry.width = depth_m.width();
  entry.height = depth_m.height();
  entry.points.resize(entry.features->size());
  if (!entries_.empty()) {
    entry.field = FlowField(ends, entries_.back().features->points, depth_m, config_.field);
    carry(entries_.back(), entry);
  }
  entries_.push_back(std::move(entry));
  while (static_cast<int>(entries_.size()) > config_.history_frames + 1) entries_.pop_front();
}

bool LabelHistory::apply(const Segmentation& masks) {
  const auto at = std::find_if(entries_.begin(), entries_.end(),
                               [&](const Entry& entry) { return entry.frame == masks.frame; });
  if (at == entries_.end() || masks.ids.empty()) return false;
  if (masks.ids.width() != at->width || masks.ids.height() != at->height) return false;
  if (at->sequence <= newest_mask_) return false;
  newest_mask_ = at->sequence;
  const auto fresh = label_by_mask(*at->features, masks, at->depth_m, config_.mask);
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    const std::size_t instance = fresh[i].instance;
    const int class_id = instance > 0 ? masks.instances[instance - 1].class_id : -1;
    at->points[i] = {fresh[i].label, fresh[i].instance, static_cast<std::int16_t>(class_id),
                     at->sequence};
  }
  for (auto next = at + 1; next != entries_.end(); ++next) carry(*(next - 1), *next);
  return true;
}

void LabelHistory::carry(const Entry& from, Entry& to) const {
  const auto& now = to.features->points;
  for (std::size_t i = 0; i < now.size(); ++i) {
    const std::int32_t k = to.link[i];
    CHECK(k < static_cast<std::int32_t>(from.points.size()));
    const bool linked = k >= 0 && to.field.reliable(static_cast<std::size_t>(k)) &&
                        from.points[k].label != SemanticLabel::kUnknown;
    to.points[i] = linked ? from.points[k] : vote(now[i], to.field, from.points);
  }
}

/// What the followed points around the feature, at its depth, are said to be.
LabelHistory::PointState LabelHistory::vote(const Feature& feature, const FlowField& field,
                                            std::span<const PointState> before) const {
  const std::int32_t k =
      field.majority_of_neighbours(feature, config_.vote_majority, [&](std::uint32_t i) {
        return before[i].label == SemanticLabel::kUnknown   ? -1
               : before[i].label == SemanticLabel::kMovable ? 1
                                                            : 0;
      });
  return k < 0 ? PointState{} : before[static_cast<std::size_t>(k)];
}

std::vector<SemanticPoint> LabelHistory::current() const {
  if (entries_.empty()) return {};
  const Entry& entry = entries_.back();
  std::vector<SemanticPoint> result(entry.points.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    const PointState& p = entry.points[i];
    const std::int32_t age = entry.sequence - p.source;
    if (p.source < 0 || age > config_.max_mask_age_frames) continue;
    result[i] = {p.label, static_cast<std::int16_t>(age), p.instance, p.class_id};
  }
  return result;
}

int LabelHistory::mask_age_frames() const {
  if (entries_.empty() || newest_mask_ < 0) return -1;
  const std::int32_t age = entries_.back().sequence - newest_mask_;
  return age <= config_.max_mask_age_frames ? age : -1;
}

void LabelHistory::clear() {
  entries_.clear();
  newest_mask_ = -1;
}

}  // namespace ygslam
