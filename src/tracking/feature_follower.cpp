#include "tracking/feature_follower.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ygslam {
namespace {

// With less of what was found features are looked for: what came into view has none.
constexpr double kLeastShare = 0.75;
constexpr double kLeastCells = 0.8;
constexpr int kCell_px = 80;

bool is_masked(const PixelMaskPtr& mask, const Eigen::Vector2f& uv_px) {
  if (!mask) return false;
  const int u = static_cast<int>(std::lround(uv_px.x()));
  const int v = static_cast<int>(std::lround(uv_px.y()));
  return mask->contains(u, v) && mask->at(u, v) != 0;
}

}  // namespace

std::optional<FrameFeatures> FeatureFollower::step(const Input& in) {
  if (frames_left_ <= 0 || !in.flow.previous) return std::nullopt;
  const Features& previous = *in.flow.previous;
  const auto& ends = in.flow.followed.ends;
  Features features;
  std::vector<std::int32_t> from;
  features.points.reserve(ends.size());
  features.descriptors.reserve(ends.size());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (!ends[i].found || is_masked(in.mask, ends[i].uv_px)) continue;
    features.points.push_back(previous.points[i]);
    features.points.back().uv_px = ends[i].uv_px;
    features.descriptors.push_back(previous.descriptors[i]);
    from.push_back(static_cast<std::int32_t>(i));
  }
  const Spread left = spread(features);
  if (left.features < kLeastShare * found_.features || left.cells < kLeastCells * found_.cells)
    return std::nullopt;
  --frames_left_;
  FrameFeatures seen = with_geometry(std::move(features), camera_, scales_, in.frame);
  seen.followed_from = std::move(from);
  return seen;
}

void FeatureFollower::start(const Features& found) {
  frames_left_ = config_.max_frames;
  if (frames_left_ > 0) found_ = spread(found);
}

FeatureFollower::Spread FeatureFollower::spread(const Features& features) const {
  const int columns = camera_.width() / kCell_px + 1;
  const int rows = camera_.height() / kCell_px + 1;
  std::vector<std::uint8_t> filled(static_cast<std::size_t>(columns) * rows, 0);
  for (const Feature& f : features.points) {
    const int column = std::clamp(static_cast<int>(f.uv_px.x()) / kCell_px, 0, columns - 1);
    const int row = std::clamp(static_cast<int>(f.uv_px.y()) / kCell_px, 0, rows - 1);
    filled[static_cast<std::size_t>(row) * columns + column] = 1;
  }
  return {static_cast<int>(features.size()),
          static_cast<int>(std::count(filled.begin(), filled.end(), 1))};
}

}  // namespace ygslam
