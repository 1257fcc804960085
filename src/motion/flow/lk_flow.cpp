#include "motion/flow/lk_flow.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "image/point_grid.hpp"
#include "motion/flow/affine_correction.hpp"
#include "motion/flow/flow_patch.hpp"
#include "motion/flow/image_pyramid_levels.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kSeeds = 64;
// A window that differs more than both is searched again from the coarsest level: by grey levels,
// and by what a shift of so many pixels would cause.
constexpr float kDoubtfulDifference = 8.0F;
constexpr float kDoubtfulShift_px = 0.8F;
constexpr float kDuplicate_px = 1.0F;  // points this near have the same window, but for its border
constexpr float kSameEnd_px = 0.7F;    // a start this near to a known end leads there again
constexpr float kCoarsePrecision = 4.0F;  // times epsilon_px: coarse levels only bring near
// A step is stretched or cut at most so much; see refine().
constexpr float kMinGain = 0.5F;
constexpr float kMaxGain = 2.0F;

bool inside(const Eigen::Vector2f& p, const PaddedImage& image, float margin_px) {
  return p.x() >= margin_px && p.y() >= margin_px &&
         p.x() <= static_cast<float>(image.width() - 1) - margin_px &&
         p.y() <= static_cast<float>(image.height() - 1) - margin_px;
}

const Eigen::Vector2f kInvalid = Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());

/// Where the search begins if guesses are right to so many pixels: within the reach of the window.
int first_level(float guess_error_px) {
  return guess_error_px < 1 ? 0 : guess_error_px < 2.5F ? 1 : 2;
}

struct Match {
  Eigen::Vector2f end_uv_px;
  FlowPatch::Difference difference;
  float gradient = 0;  // of the window, root mean square [grey levels per pixel]
};

bool is_doubtful(const Match& match) {
  return match.difference.window > kDoubtfulDifference &&
         match.difference.window > kDoubtfulShift_px * match.gradient;
}

class PointFollower {
 public:
  PointFollower(const ImagePyramid::Levels& previous, const ImagePyramid::Levels& current,
                const FlowConfig& config)
      : previous_(previous.level),
        current_(current.level),
        config_(config),
        top_(std::min({static_cast<int>(previous_.size()), static_cast<int>(current_.size()),
                       config.levels + 1}) -
             1),
        patch_(config.window_px) {}

  [[nodiscard]] int top() const { return top_; }

  /// @param first level the search begins at; where that fails it begins again at the top.
  [[nodiscard]] FlowPoint follow(const Eigen::Vector2f& from, const Eigen::Vector2f& guess,
                                 int first) {
    if (!from.allFinite() || !inside(from, previous_[0], 0)) return {};
    std::optional<Match> match = search(from, guess, std::min(first, top_), kInvalid);
    if (first < top_ && (!match || is_doubtful(*match))) {
      const auto again = search(from, guess, top_, match ? match->end_uv_px : kInvalid);
      if (again && (!match || again->difference.window < match->difference.window)) match = again;
    }
    return match ? judge(from, *match) : FlowPoint{};
  }

 private:
  /// Coarse to fine from a level on (Bouguet 2000).
  /// @param known end of an earlier search. @return nullopt: no texture, left the image, or on the
  /// way to the known end.
  [[nodiscard]] std::optional<Match> search(const Eigen::Vector2f& from,
                                            const Eigen::Vector2f& guess, int first_level,
                                            const Eigen::Vector2f& known) {
    Eigen::Vector2f end = std::ldexp(1.0F, -first_level) * guess;
    for (int level = first_level; level >= 0; --level) {
      if (level == 0 && (end - known).squaredNorm() < kSameEnd_px * kSameEnd_px)
        return std::nullopt;
      patch_.take(previous_[level], std::ldexp(1.0F, -level) * from);
      const bool textured = patch_.min_eigenvalue() >= config_.min_eigenvalue;
      const auto refined = textured ? refine(level, end) : std::nullopt;
      if (level == 0) {
        if (!refined || !inside(*refined, current_[0], 0)) return std::nullopt;
        return Match{*refined, patch_.difference(current_[0], *refined), patch_.mean_gradient()};
      }
      // A coarse level that says nothing leaves the end where it was.
      end = 2 * refined.value_or(end);
    }
    return std::nullopt;
  }

  [[nodiscard]] std::optional<Eigen::Vector2f> refine(int level, Eigen::Vector2f at) const {
    const auto epsilon =
        static_cast<float>(config_.epsilon_px) * (level > 0 ? kCoarsePrecision : 1);
    Eigen::Vector2f last_step = Eigen::Vector2f::Zero();
    Eigen::Vector2f last_move = Eigen::Vector2f::Zero();
    for (int i = 0; i < config_.max_iterations; ++i) {
      if (!at.allFinite() || !FlowPatch::is_in_reach(current_[level], at)) return std::nullopt;
      const Eigen::Vector2f step = patch_.step(current_[level], at);
      if (step.squaredNorm() <= epsilon * epsilon) {
        at += step;
        break;
      }
      // Secant: how much of the last move the step has lost tells how much it falls short of the
      // end, or overshoots.
      float gain = 1;
      if (i > 0)
        gain = std::clamp((last_step - step).dot(last_move) / last_move.squaredNorm(), kMinGain,
                          kMaxGain);
      last_step = step;
      last_move = step / gain;
      at += last_move;
    }
    return at.allFinite() && FlowPatch::is_in_reach(current_[level], at) ? std::optional(at)
                                                                         : std::nullopt;
  }

  [[nodiscard]] FlowPoint judge(const Eigen::Vector2f& from, const Match& match) const {
    FlowPoint point;
    point.end_uv_px = match.end_uv_px;
    // The 3x3 patches and their interpolation need two pixels on each side.
    const bool whole = inside(from, previous_[0], 2) && inside(match.end_uv_px, current_[0], 2);
    point.patch_diff = whole ? match.difference.centre : 255.0F;
    if (!inside(match.end_uv_px, current_[0], static_cast<float>(config_.border_px))) {
      point.status = FlowStatus::kBorder;
    } else {
      point.status =
          point.patch_diff > config_.patch_diff ? FlowStatus::kPatch : FlowStatus::kFound;
    }
    return point;
  }

  const std::vector<PaddedImage>& previous_;
  const std::vector<PaddedImage>& current_;
  const FlowConfig& config_;
  int top_;
  FlowPatch patch_;
};

/// Per point the first one within kDuplicate_px, itself if none comes before it: a corner is found
/// on several pyramid levels, and its flow is the same.
std::vector<std::uint32_t> duplicates(std::span<const Eigen::Vector2f> points_uv_px) {
  PointGrid grid(2 * kDuplicate_px);
  grid.build(points_uv_px);
  std::vector<std::uint32_t> first_of(points_uv_px.size());
  for (std::uint32_t i = 0; i < first_of.size(); ++i) {
    first_of[i] = i;
    grid.near(points_uv_px[i], kDuplicate_px, [&](std::uint32_t k) {
      if (k < first_of[i] &&
          (points_uv_px[k] - points_uv_px[i]).squaredNorm() <= kDuplicate_px * kDuplicate_px)
        first_of[i] = k;
    });
  }
  return first_of;
}

}  // namespace

std::vector<FlowPoint> track_points(const ImagePyramid& previous, const ImagePyramid& current,
                                    std::span<const Eigen::Vector2f> points_uv_px,
                                    std::span<const Eigen::Vector2f> guesses_uv_px,
                                    const FlowConfig& config) {
  CHECK(!previous.empty() && !current.empty());
  CHECK(previous.width() == current.width() && previous.height() == current.height());
  CHECK(previous.levels().window_px >= config.window_px &&
        current.levels().window_px >= config.window_px);
  CHECK(guesses_uv_px.empty() || guesses_uv_px.size() == points_uv_px.size());
  const auto guess = [&](std::size_t i) {
    return !guesses_uv_px.empty() && guesses_uv_px[i].allFinite() ? guesses_uv_px[i]
                                                                  : points_uv_px[i];
  };
  std::vector<FlowPoint> flow(points_uv_px.size());
  PointFollower follower(previous.levels(), current.levels(), config);
  // Seed points are searched with care; the others start where the seeds say.
  const std::size_t every = std::max<std::size_t>(flow.size() / kSeeds, 1);
  std::vector<Eigen::Vector2f> expected;
  std::vector<Eigen::Vector2f> found;
  for (std::size_t i = 0; i < flow.size(); i += every) {
    flow[i] = follower.follow(points_uv_px[i], guess(i), follower.top());
    if (flow[i].status != FlowStatus::kFound) continue;
    expected.push_back(guess(i));
    found.push_back(flow[i].end_uv_px);
  }
  const auto correction = fit_affine_correction(expected, found);
  const int first = correction ? first_level(correction->error_px) : follower.top();
  const std::vector<std::uint32_t> first_of = duplicates(points_uv_px);
  for (std::size_t i = 0; i < flow.size(); ++i) {
    if (i % every == 0) continue;
    if (first_of[i] != i && flow[first_of[i]].status == FlowStatus::kFound) {
      flow[i] = flow[first_of[i]];
      flow[i].end_uv_px += points_uv_px[i] - points_uv_px[first_of[i]];
      continue;
    }
    flow[i] =
        follower.follow(points_uv_px[i], correction ? (*correction)(guess(i)) : guess(i), first);
  }
  return flow;
}

std::vector<FlowEnd> flow_ends(std::span<const FlowPoint> flow) {
  std::vector<FlowEnd> ends(flow.size());
  for (std::size_t i = 0; i < flow.size(); ++i)
    ends[i] = {flow[i].end_uv_px, flow[i].status == FlowStatus::kFound};
  return ends;
}

}  // namespace ygslam
