#include "motion/masks/mask_labels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

#include "core/statistics.hpp"

namespace ygslam {
namespace {

constexpr int kStride_px = 8;  // between the samples of an object's depth
constexpr int kWindow = 7;     // samples on a side of the square in which it is asked for

/// What surrounds a pixel within the band.
struct Surroundings {
  std::uint8_t nearest_movable = 0;  // id of the nearest movable pixel, 0 = none within the band
  bool at_edge = false;              // both movable and other pixels within the band
};

class Labeller {
 public:
  Labeller(const Segmentation& masks, const CoarseDepth& depth_m, const MaskConfig& config)
      : ids_(masks.ids),
        depth_m_(depth_m),
        config_(config),
        movable_(movable_ids(masks, config.movable)) {
    sample();
  }

  [[nodiscard]] PointMask label(const Feature& feature) const {
    PointMask result;
    if (!feature.uv_px.allFinite()) return result;
    const int u = static_cast<int>(std::lround(feature.uv_px.x()));
    const int v = static_cast<int>(std::lround(feature.uv_px.y()));
    if (!ids_.contains(u, v)) return result;
    const float depth_m = std::isfinite(feature.depth_m) ? feature.depth_m : 0.0F;
    const std::uint8_t id = movable_[ids_.at(u, v)] ? ids_.at(u, v) : 0;
    const Surroundings around = look_around(u, v);
    if (id == 0) return outside(around, u, v, depth_m);
    return inside(id, around, u, v, depth_m);
  }

 private:
  /// Objects and depths at every kStride_px-th pixel.
  void sample() {
    columns_ = (ids_.width() + kStride_px - 1) / kStride_px;
    rows_ = (ids_.height() + kStride_px - 1) / kStride_px;
    samples_.resize(static_cast<std::size_t>(columns_) * rows_);
    std::array<std::vector<float>, 256> of_instance;
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) {
        const int u = column * kStride_px;
        const int v = row * kStride_px;
        const std::uint8_t id = movable_[ids_.at(u, v)] ? ids_.at(u, v) : 0;
        const float depth_m = id > 0 ? depth_m_.at(u, v) : 0.0F;
        if (!(depth_m > 0)) continue;
        samples_[static_cast<std::size_t>(row) * columns_ + column] = {depth_m, id};
        of_instance[id].push_back(depth_m);
      }
    }
    for (std::size_t id = 1; id < of_instance.size(); ++id)
      instance_depth_m_[id] = of_instance[id].empty() ? 0 : median(of_instance[id]);
  }

  /// True if all pixels of the square about a pixel have its id; false also where this is not
  /// known: near the border, and for squares that two words a row do not span.
  [[nodiscard]] bool is_uniform(int u, int v, int r) const {
    const int side = 2 * r + 1;
    if (side < 4 || side > 16 || !ids_.contains(u - r, v - r) || !ids_.contains(u + r, v + r))
      return false;
    return side < 8 ? has_uniform_rows<std::uint32_t>(u, v, r)
                    : has_uniform_rows<std::uint64_t>(u, v, r);
  }

  template <typename Word>
  [[nodiscard]] bool has_uniform_rows(int u, int v, int r) const {
    const Word same = static_cast<Word>(0x0101010101010101U) * ids_.at(u, v);
    Word other = 0;
    for (int dv = -r; dv <= r; ++dv) {
      const std::uint8_t* row = ids_.row(v + dv) + u - r;
      Word first = 0;
      Word last = 0;
      std::memcpy(&first, row, sizeof(Word));
      std::memcpy(&last, row + 2 * r + 1 - sizeof(Word), sizeof(Word));
      other |= (first ^ same) | (last ^ same);
    }
    return other == 0;
  }

  [[nodiscard]] Surroundings look_around(int u, int v) const {
    Surroundings found;
    const double band_px = movable_[ids_.at(u, v)] ? config_.inner_band_px : config_.outer_band_px;
    const int r = static_cast<int>(std::ceil(band_px));
    if (is_uniform(u, v, r)) {
      if (const std::uint8_t id = ids_.at(u, v); movable_[id]) found.nearest_movable = id;
      return found;
    }
    const double limit2 = band_px * band_px;
    int nearest2 = 1 << 30;
    bool other = false;
    for (int y = std::max(v - r, 0); y <= std::min(v + r, ids_.height() - 1); ++y) {
      const std::uint8_t* row = ids_.row(y);
      for (int x = std::max(u - r, 0); x <= std::min(u + r, ids_.width() - 1); ++x) {
        const int d2 = (x - u) * (x - u) + (y - v) * (y - v);
        if (d2 > limit2) continue;
        const std::uint8_t id = row[x];
        if (!movable_[id]) {
          other = true;
        } else if (d2 < nearest2) {
          nearest2 = d2;
          found.nearest_movable = id;
        }
      }
    }
    found.at_edge = other && found.nearest_movable != 0;
    return found;
  }

  /// Depth of the object near a pixel [m], 0 if unknown.
  [[nodiscard]] float object_depth_m(std::uint8_t id, int u, int v) const {
    std::array<float, kWindow * kWindow> depths_m;
    std::size_t n = 0;
    const int column = u / kStride_px - kWindow / 2;
    const int row = v / kStride_px - kWindow / 2;
    for (int r = std::max(row, 0); r < std::min(row + kWindow, rows_); ++r) {
      for (int c = std::max(column, 0); c < std::min(column + kWindow, columns_); ++c) {
        const Sample& sample = samples_[static_cast<std::size_t>(r) * columns_ + c];
        if (sample.id == id) depths_m[n++] = sample.depth_m;
      }
    }
    return n == 0 ? instance_depth_m_[id] : median(std::span(depths_m.data(), n));
  }

  [[nodiscard]] PointMask outside(const Surroundings& around, int u, int v, float depth_m) const {
    if (!around.at_edge) return {SemanticLabel::kStatic, 0};
    const float object_m = object_depth_m(around.nearest_movable, u, v);
    if (depth_m <= 0 || object_m <= 0) return {SemanticLabel::kUnknown, around.nearest_movable};
    const bool same = std::abs(depth_m - object_m) <= config_.same_depth_ratio * object_m;
    return same ? PointMask{SemanticLabel::kMovable, around.nearest_movable}
                : PointMask{SemanticLabel::kStatic, 0};
  }

  [[nodiscard]] PointMask inside(std::uint8_t id, const Surroundings& around, int u, int v,
                                 float depth_m) const {
    const PointMask on_object{SemanticLabel::kMovable, id};
    // The sensor sees no depth in the shadow beside a near object: the background's as often as
    // its.
    if (depth_m <= 0) return around.at_edge ? PointMask{SemanticLabel::kUnknown, id} : on_object;
    const float whole_m = instance_depth_m_[id];
    if (whole_m > 0 && depth_m > (1 + config_.far_behind_ratio) * whole_m)
      return {SemanticLabel::kStatic, 0};
    if (!around.at_edge) return on_object;
    const float object_m = object_depth_m(id, u, v);
    const bool behind = object_m > 0 && depth_m > (1 + config_.behind_ratio) * object_m;
    return behind ? PointMask{SemanticLabel::kStatic, 0} : on_object;
  }

  struct Sample {
    float depth_m = 0;
    std::uint8_t id = 0;  // of a movable thing with depth, else 0
  };

  const GreyImage& ids_;
  const CoarseDepth& depth_m_;
  const MaskConfig& config_;
  std::array<std::uint8_t, 256> movable_;
  std::array<float, 256> instance_depth_m_{};
  std::vector<Sample> samples_;
  int columns_ = 0;
  int rows_ = 0;
};

}  // namespace

CoarseDepth::CoarseDepth(const DepthImage& depth_m)
    : samples_m_((depth_m.width() + kStep - 1) / kStep, (depth_m.height() + kStep - 1) / kStep) {
  for (int v = 0; v < samples_m_.height(); ++v) {
    const float* from = depth_m.row(v * kStep);
    float* to = samples_m_.row(v);
    for (int u = 0; u < samples_m_.width(); ++u) {
      const float d = from[u * kStep];
      to[u] = std::isfinite(d) && d > 0 ? d : 0.0F;
    }
  }
}

std::vector<PointMask> label_by_mask(const Features& features, const Segmentation& masks,
                                     const CoarseDepth& depth_m, const MaskConfig& config) {
  std::vector<PointMask> labels(features.size());
  if (masks.ids.empty()) return labels;
  const Labeller labeller(masks, depth_m, config);
  for (std::size_t i = 0; i < features.size(); ++i) labels[i] = labeller.label(features.points[i]);
  return labels;
}

}  // namespace ygslam
