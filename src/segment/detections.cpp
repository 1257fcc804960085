#include "segment/detections.hpp"

#include <algorithm>
#include <numeric>

namespace ygslam {
namespace {

constexpr int kMaxCandidates = 1000;  // bounds the suppression when every row fires

struct Candidates {
  std::vector<Instance> instances;
  std::vector<int> rows;  // of the network's output, of each instance
  int rejected = 0;
};

/// Sets the box in the recorded image, clipped to it. @return false if nothing is left.
bool place(const std::optional<NetworkBox>& corners, const Letterbox& box, Instance& instance) {
  if (!corners) return false;
  const EdgePoint low = box.to_image(corners->low);
  const EdgePoint high = box.to_image(corners->high);
  instance.x0 = static_cast<float>(std::clamp(low.x, 0.0, double(box.image_width)));
  instance.y0 = static_cast<float>(std::clamp(low.y, 0.0, double(box.image_height)));
  instance.x1 = static_cast<float>(std::clamp(high.x, 0.0, double(box.image_width)));
  instance.y1 = static_cast<float>(std::clamp(high.y, 0.0, double(box.image_height)));
  return instance.x1 > instance.x0 && instance.y1 > instance.y0;
}

Candidates collect(const OutputDecoder& decoder, const Letterbox& box, const ClassSet& classes,
                   double score_threshold) {
  const RowScores best = decoder.scores(classes);
  std::vector<int> firing;
  for (int i = 0; i < std::ssize(best.score); ++i) {
    if (best.score[i] >= score_threshold) firing.push_back(i);
  }
  std::stable_sort(firing.begin(), firing.end(),
                   [&](int a, int b) { return best.score[a] > best.score[b]; });
  if (firing.size() > kMaxCandidates) firing.resize(kMaxCandidates);

  Candidates out;
  out.rejected = best.invalid;
  for (const int row : firing) {
    Instance instance{best.class_id[row], std::min(best.score[row], 1.0F)};
    if (place(decoder.box(row), box, instance)) {
      out.instances.push_back(instance);
      out.rows.push_back(row);
    } else {
      ++out.rejected;
    }
  }
  return out;
}

void draw(OutputDecoder& decoder, const Candidates& candidates, const DecodeConfig& config,
          Decoded& out) {
  out.rejected += candidates.rejected;
  const int left = kMaxInstances - static_cast<int>(out.instances.size());
  const int limit = std::clamp(config.max_instances, 0, left);
  for (const int i : suppress_overlaps(candidates.instances, config.nms_iou, limit)) {
    const auto id = static_cast<std::uint8_t>(out.instances.size() + 1);
    // Best first, and only on pixels still free: where masks overlap the better score wins.
    if (decoder.paint(candidates.rows[i], candidates.instances[i], id, out.ids)) {
      out.instances.push_back(candidates.instances[i]);
    } else {
      ++out.rejected;
    }
  }
}

/// Leaves out candidates whose box is that of an instance.
void drop_covered(std::span<const Instance> instances, double max_iou, Candidates& candidates) {
  Candidates rest{{}, {}, candidates.rejected};
  for (std::size_t k = 0; k < candidates.rows.size(); ++k) {
    const bool is_covered = std::any_of(
        instances.begin(), instances.end(),
        [&](const Instance& better) { return box_iou(better, candidates.instances[k]) > max_iou; });
    if (is_covered) continue;
    rest.instances.push_back(candidates.instances[k]);
    rest.rows.push_back(candidates.rows[k]);
  }
  candidates = std::move(rest);
}

}  // namespace

float box_iou(const Instance& a, const Instance& b) {
  const float w = std::min(a.x1, b.x1) - std::max(a.x0, b.x0);
  const float h = std::min(a.y1, b.y1) - std::max(a.y0, b.y0);
  if (w <= 0 || h <= 0) return 0;
  const float both = w * h;
  return both / ((a.x1 - a.x0) * (a.y1 - a.y0) + (b.x1 - b.x0) * (b.y1 - b.y0) - both);
}

std::vector<int> suppress_overlaps(std::span<const Instance> candidates, double max_iou,
                                   int limit) {
  std::vector<int> order(candidates.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return candidates[a].score > candidates[b].score; });
  std::vector<int> kept;
  for (const int i : order) {
    if (static_cast<int>(kept.size()) >= limit) break;
    const bool covered = std::any_of(kept.begin(), kept.end(), [&](int k) {
      return candidates[k].class_id == candidates[i].class_id &&
             box_iou(candidates[k], candidates[i]) > max_iou;
    });
    if (!covered) kept.push_back(i);
  }
  return kept;
}

Decoded decode_detections(OutputDecoder& decoder, const Letterbox& box,
                          const DecodeConfig& config) {
  ClassSet wanted{}, others{};
  wanted.fill(config.classes.empty());
  for (const int class_id : config.classes) {
    if (class_id >= 0 && class_id < kCocoClasses) wanted[class_id] = true;
  }
  std::transform(wanted.begin(), wanted.end(), others.begin(), [](bool is_in) { return !is_in; });

  Decoded out{{}, GreyImage(box.image_width, box.image_height), 0};
  draw(decoder, collect(decoder, box, wanted, config.score_threshold), config, out);
  if (!config.others) return out;
  Candidates candidates = collect(decoder, box, others, config.others_threshold);
  drop_covered(out.instances, config.nms_iou, candidates);
  draw(decoder, candidates, config, out);
  return out;
}

}  // namespace ygslam
