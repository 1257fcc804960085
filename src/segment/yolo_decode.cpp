#include "segment/yolo_decode.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "segment/mask_painter.hpp"

namespace ygslam {
namespace {

constexpr int kMaxCandidates = 1000;  // bounds the suppression when every cell fires
constexpr float kScoreSlack = 1e-3F;  // a sigmoid may round above 1 in low precision

struct Candidates {
  std::vector<Instance> instances;
  std::vector<int> cells;  // column of each instance
  int rejected = 0;
};

struct BestClass {
  std::vector<float> score;
  std::vector<int> class_id;
  int invalid = 0;  // scores that are not probabilities
};

/// Per cell the best of the wanted classes; row by row, as the scores lie in memory.
BestClass best_classes(const YoloOutputs& outputs, std::span<const int> classes) {
  const int n = outputs.cells;
  BestClass best{std::vector<float>(n, 0.0F), std::vector<int>(n, 0), 0};
  for (const int class_id : classes) {
    if (class_id < 0 || class_id >= kYoloClasses) continue;
    const float* row =
        outputs.detections.data() + static_cast<std::ptrdiff_t>(n) * (kYoloBoxValues + class_id);
    for (int i = 0; i < n; ++i) {
      const float s = row[i];
      const bool valid = s >= -kScoreSlack && s <= 1.0F + kScoreSlack;
      best.invalid += valid ? 0 : 1;
      const bool better = valid && s > best.score[i];
      best.score[i] = better ? s : best.score[i];
      best.class_id[i] = better ? class_id : best.class_id[i];
    }
  }
  return best;
}

/// Box of one cell in the recorded image, clipped to it. @return false if nothing is left.
bool read_box(const YoloOutputs& outputs, int cell, const Letterbox& box, Instance& instance) {
  float v[kYoloBoxValues];
  for (int k = 0; k < kYoloBoxValues; ++k) {
    v[k] = outputs.detections[static_cast<std::size_t>(k) * outputs.cells + cell];
    if (!std::isfinite(v[k])) return false;
  }
  const EdgePoint low = box.to_image({v[0] - 0.5 * v[2], v[1] - 0.5 * v[3]});
  const EdgePoint high = box.to_image({v[0] + 0.5 * v[2], v[1] + 0.5 * v[3]});
  instance.x0 = static_cast<float>(std::clamp(low.x, 0.0, double(box.image_width)));
  instance.y0 = static_cast<float>(std::clamp(low.y, 0.0, double(box.image_height)));
  instance.x1 = static_cast<float>(std::clamp(high.x, 0.0, double(box.image_width)));
  instance.y1 = static_cast<float>(std::clamp(high.y, 0.0, double(box.image_height)));
  return instance.x1 > instance.x0 && instance.y1 > instance.y0;
}

std::optional<MaskCoefficients> read_coefficients(const YoloOutputs& outputs, int cell) {
  MaskCoefficients c{};
  const std::size_t first = kYoloBoxValues + kYoloClasses;
  for (std::size_t k = 0; k < c.size(); ++k) {
    c[k] = outputs.detections[(first + k) * outputs.cells + cell];
    if (!std::isfinite(c[k])) return std::nullopt;
  }
  return c;
}

Candidates collect(const YoloOutputs& outputs, const Letterbox& box, std::span<const int> classes,
                   double score_threshold) {
  const BestClass best = best_classes(outputs, classes);
  std::vector<int> firing;
  for (int i = 0; i < outputs.cells; ++i) {
    if (best.score[i] >= score_threshold) firing.push_back(i);
  }
  std::stable_sort(firing.begin(), firing.end(),
                   [&](int a, int b) { return best.score[a] > best.score[b]; });
  if (firing.size() > kMaxCandidates) firing.resize(kMaxCandidates);

  Candidates out;
  out.rejected = best.invalid;
  for (const int cell : firing) {
    Instance instance{best.class_id[cell], std::min(best.score[cell], 1.0F)};
    if (read_box(outputs, cell, box, instance)) {
      out.instances.push_back(instance);
      out.cells.push_back(cell);
    } else {
      ++out.rejected;
    }
  }
  return out;
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

namespace {

void draw(const YoloOutputs& outputs, const Candidates& candidates, const DecodeConfig& config,
          MaskPainter& painter, DecodedYolo& out) {
  out.rejected += candidates.rejected;
  const int left = kMaxInstances - static_cast<int>(out.instances.size());
  const int limit = std::clamp(config.max_instances, 0, left);
  for (const int i : suppress_overlaps(candidates.instances, config.nms_iou, limit)) {
    const auto coefficients = read_coefficients(outputs, candidates.cells[i]);
    const auto id = static_cast<std::uint8_t>(out.instances.size() + 1);
    // Best first, and only on pixels still free: where masks overlap the better score wins.
    if (coefficients && painter.paint(*coefficients, candidates.instances[i], id, out.ids)) {
      out.instances.push_back(candidates.instances[i]);
    } else {
      ++out.rejected;
    }
  }
}

/// Leaves out candidates whose box is that of an instance.
void drop_covered(std::span<const Instance> instances, double max_iou, Candidates& candidates) {
  Candidates rest{{}, {}, candidates.rejected};
  for (std::size_t k = 0; k < candidates.cells.size(); ++k) {
    const bool is_covered = std::any_of(
        instances.begin(), instances.end(),
        [&](const Instance& better) { return box_iou(better, candidates.instances[k]) > max_iou; });
    if (is_covered) continue;
    rest.instances.push_back(candidates.instances[k]);
    rest.cells.push_back(candidates.cells[k]);
  }
  candidates = std::move(rest);
}

}  // namespace

DecodedYolo decode_yolo(const YoloOutputs& outputs, const Letterbox& box,
                        const DecodeConfig& config) {
  CHECK(outputs.detections.size() == static_cast<std::size_t>(kYoloChannels) * outputs.cells);
  CHECK(outputs.prototypes.size() ==
        static_cast<std::size_t>(kYoloCoefficients) * outputs.proto_width * outputs.proto_height);
  const auto is_wanted = [&](int class_id) {
    return config.classes.empty() || std::find(config.classes.begin(), config.classes.end(),
                                               class_id) != config.classes.end();
  };
  std::vector<int> wanted, others;
  for (int class_id = 0; class_id < kYoloClasses; ++class_id)
    (is_wanted(class_id) ? wanted : others).push_back(class_id);
  DecodedYolo out{{}, GreyImage(box.image_width, box.image_height), 0};
  MaskPainter painter(outputs, box);
  draw(outputs, collect(outputs, box, wanted, config.score_threshold), config, painter, out);
  if (!config.others) return out;
  Candidates candidates = collect(outputs, box, others, config.others_threshold);
  drop_covered(out.instances, config.nms_iou, candidates);
  draw(outputs, candidates, config, painter, out);
  return out;
}

}  // namespace ygslam
