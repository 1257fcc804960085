#include "features/orb.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/check.hpp"
#include "features/corner_grid.hpp"
#include "features/corner_strength.hpp"

namespace ygslam {

namespace {

constexpr int kMargin_px = kPatchRadius + 1;
constexpr int kSmallestSide_px = 2 * kMargin_px + 2;
// FAST score (grey values) times Harris' measure (grey values to the fourth): the fifth root is
// proportional to the contrast.
constexpr float kStrengthPower = 0.2F;

/// Of cells without a corner.
int low_threshold(int fast_threshold) {
  return std::max(1, static_cast<int>(std::lround(fast_threshold / 3.0)));
}

/// Whether a corner lies on what is masked, or on its edge: so far FAST's circle reaches.
bool is_masked(const Corner& corner, double scale, const GreyImage& masked) {
  constexpr int kCircle_px = 3;
  for (const int dv : {-kCircle_px, 0, kCircle_px}) {
    for (const int du : {-kCircle_px, 0, kCircle_px}) {
      const int u = static_cast<int>(std::lround(scale * (corner.u + du)));
      const int v = static_cast<int>(std::lround(scale * (corner.v + dv)));
      if (masked.contains(u, v) && masked.at(u, v) != 0) return true;
    }
  }
  return false;
}

int level_size(int size, double scale) { return static_cast<int>((size - 1) / scale) + 1; }

}  // namespace

OrbExtractor::OrbExtractor(const OrbConfig& config)
    : config_(config),
      scales_(config.levels, config.scale_factor),
      pyramid_(static_cast<std::size_t>(config.levels)) {
  CHECK(config.features >= 0 && config.levels <= 32);
  CHECK(config.scale_factor >= 1.05 && config.scale_factor <= 2.0);
  CHECK(config.fast_threshold >= 1);
  CHECK(config.fast_threshold <= 254 && config.cell_px >= 8 && config.evenness >= 0);
}

void OrbExtractor::build_pyramid(const GreyImage& image) {
  levels_ = 0;
  for (int level = 0; level < config_.levels; ++level) {
    const double scale = scales_.of(level);
    const int width = level_size(image.width(), scale);
    const int height = level_size(image.height(), scale);
    if (std::min(width, height) < kSmallestSide_px) return;
    if (level == 0) {
      pyramid_[0].assign(image, kLevelBorder_px);
    } else {
      reduce(pyramid_[level - 1], config_.scale_factor, width, height, pyramid_[level]);
    }
    ++levels_;
  }
}

// In proportion to the levels' areas.
std::vector<int> OrbExtractor::quotas() const {
  std::vector<double> area;
  double total = 0;
  for (int level = 0; level < levels_; ++level) {
    area.push_back(static_cast<double>(pyramid_[level].width()) * pyramid_[level].height());
    total += area.back();
  }
  std::vector<int> quotas;
  double share = 0;
  int given = 0;
  for (const double a : area) {
    share += config_.features * a / total;
    quotas.push_back(static_cast<int>(std::lround(share)) - given);
    given += quotas.back();
  }
  return quotas;
}

int OrbExtractor::extract_level(int level, int quota, const GreyImage* masked, Features& features) {
  const PaddedImage& image = pyramid_[level];
  detector_.detect(image, kMargin_px, config_.cell_px, config_.fast_threshold,
                   low_threshold(config_.fast_threshold), corners_);
  if (masked)
    std::erase_if(corners_,
                  [&](const Corner& c) { return is_masked(c, scales_.of(level), *masked); });
  for (Corner& c : corners_) c.score *= harris_strength(image.row(c.v) + c.u, image.stride());
  const std::vector<Corner> chosen = spread_corners(corners_, quota, config_.evenness);
  if (chosen.empty()) return 0;

  blur_7x7(image, smooth_);
  const auto scale = static_cast<float>(scales_.of(level));
  for (const Corner& c : chosen) {
    const std::uint8_t* const pixel = image.row(c.v) + c.u;
    const Orientation orientation = patch_orientation(pixel, image.stride());
    Feature feature;
    feature.uv_px = scale * (Eigen::Vector2f(c.u, c.v) + corner_offset_px(pixel, image.stride()));
    feature.ideal_px = feature.uv_px;
    feature.angle_rad = orientation.angle_rad();
    feature.response = std::pow(c.score, kStrengthPower);
    feature.octave = static_cast<std::uint8_t>(level);
    features.points.push_back(feature);
    features.descriptors.push_back(
        brief_.describe(smooth_.row(c.v) + c.u, smooth_.stride(), orientation));
  }
  return static_cast<int>(chosen.size());
}

Features OrbExtractor::extract(const GreyImage& image, const GreyImage* masked) {
  CHECK(!masked || masked->same_size(image));
  Features features;
  build_pyramid(image);
  const std::vector<int> quota = quotas();
  features.points.reserve(static_cast<std::size_t>(config_.features));
  features.descriptors.reserve(static_cast<std::size_t>(config_.features));
  int missing = 0;  // what a level lacks, the next ones may give
  for (int level = 0; level < levels_; ++level) {
    const int wanted = quota[level] + missing;
    missing = wanted - extract_level(level, wanted, masked, features);
  }
  return features;
}

}  // namespace ygslam
