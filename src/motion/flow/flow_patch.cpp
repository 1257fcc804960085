#include "motion/flow/flow_patch.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/check.hpp"
#include "motion/flow/image_pyramid_levels.hpp"
#include "motion/flow/words16.hpp"

namespace ygslam {
namespace {

constexpr int kLanes = 16;
constexpr int kValueBits = 6;     // grey levels in 1/64: 255 of them fit a word with its sign
constexpr int kGradientBits = 5;  // gradients in 1/32 grey level per pixel, at most 4080
// So many rows of products (two a lane) fit 32 bits: 32 * 16320 * 4080 < 2^31.
constexpr int kRowsPerSum = 16;

int stride_of(int window_px) { return (window_px + 2 + kLanes - 1) / kLanes * kLanes; }

/// Reads an image between its pixels, sixteen at a time, row after row.
class Sampler {
 public:
  /// @param left_px, top_px where the first of the sixteen columns and the first row lie from
  /// at_px.
  Sampler(const PaddedImage& image, const Eigen::Vector2f& at_px, int left_px, int top_px)
      : stride_(image.stride()) {
    const float x0 = std::floor(at_px.x());
    const float y0 = std::floor(at_px.y());
    pixel_ = image.row(static_cast<int>(y0) + top_px) + static_cast<int>(x0) + left_px;
    along_ = Words::all(weight(at_px.x() - x0));
    down_ = Words::all(weight(at_px.y() - y0));
    above_ = along();
  }
  Words next_row() {
    pixel_ += stride_;
    const Words below = along();
    const Words row = above_ + (below - above_).scaled(down_);
    above_ = below;
    return row;
  }

 private:
  static std::int16_t weight(float fraction) {
    return static_cast<std::int16_t>(std::min(fraction * 32768.0F + 0.5F, 32767.0F));
  }
  [[nodiscard]] Words along() const {
    const Words left = Words::load_bytes(pixel_).shifted_left(kValueBits);
    const Words right = Words::load_bytes(pixel_ + 1).shifted_left(kValueBits);
    return left + (right - left).scaled(along_);
  }

  const std::uint8_t* pixel_;
  std::ptrdiff_t stride_;
  Words along_, down_, above_;
};

/// Weights 3 10 3 of sixteenths, across the direction of a gradient (Scharr).
Words smoothed(Words before, Words middle, Words after) {
  return middle.scaled(Words::all(10 * 2048)) + (before + after).scaled(Words::all(3 * 2048));
}

/// From the difference of values two pixels apart.
Words gradient(Words difference) {
  return (difference + Words::all(2)).shifted_right(kValueBits + 1 - kGradientBits);
}

/// What a row of values adds to the gradients of its neighbours.
struct GradientRow {
  Words along, smooth;

  explicit GradientRow(const std::int16_t* left) {
    const Words before = Words::load(left);
    const Words after = Words::load(left + 2);
    along = after - before;
    smooth = smoothed(before, Words::load(left + 1), after);
  }
};

}  // namespace

FlowPatch::FlowPatch(int window_px)
    : window_px_(window_px), half_px_(window_px / 2), stride_(stride_of(window_px)) {
  CHECK(window_px >= 3 && window_px % 2 == 1);
  const auto rows = static_cast<std::size_t>(window_px);
  // Vector loads run on beyond the last row.
  around_.resize((rows + 2) * stride_ + kLanes);
  for (auto* buffer : {&gx_, &gy_}) buffer->resize(rows * stride_);
  inside_.assign(static_cast<std::size_t>(stride_), 0);
  std::fill_n(inside_.begin(), window_px, std::int16_t{1});
}

int FlowPatch::reach_px(int window_px) {
  const int half = window_px / 2;
  // take() reads a pixel more on each side, and either may lie a pixel outside the image.
  const int reach = std::max(half + 3, stride_of(window_px) - half + 2);
  return (reach + 7) / 8 * 8;
}

bool FlowPatch::is_in_reach(const PaddedImage& image, const Eigen::Vector2f& at_px) {
  return at_px.x() >= -1 && at_px.y() >= -1 && at_px.x() <= static_cast<float>(image.width()) &&
         at_px.y() <= static_cast<float>(image.height());
}

void FlowPatch::take(const PaddedImage& image, const Eigen::Vector2f& centre_px) {
  for (int c = 0; c < stride_; c += kLanes) {
    Sampler sampler(image, centre_px, c - half_px_ - 1, -half_px_ - 1);
    for (int r = 0; r < window_px_ + 2; ++r)
      sampler.next_row().store(around_.data() + static_cast<std::ptrdiff_t>(r) * stride_ + c);
  }
  measure_gradients();
}

void FlowPatch::measure_gradients() {
  std::int64_t xx = 0;
  std::int64_t xy = 0;
  std::int64_t yy = 0;
  for (int c = 0; c < stride_; c += kLanes) {
    const Words inside = Words::zero() - Words::load(inside_.data() + c);
    Sums sum_xx, sum_xy, sum_yy;
    const std::int16_t* row = around_.data() + c;
    GradientRow above(row);
    GradientRow here(row += stride_);
    for (std::ptrdiff_t i = c; i < static_cast<std::ptrdiff_t>(gx_.size()); i += stride_) {
      const GradientRow below(row += stride_);
      const Words gx = gradient(smoothed(above.along, here.along, below.along)) & inside;
      const Words gy = gradient(below.smooth - above.smooth) & inside;
      gx.store(gx_.data() + i);
      gy.store(gy_.data() + i);
      sum_xx.add_products(gx, gx);
      sum_xy.add_products(gx, gy);
      sum_yy.add_products(gy, gy);
      above = here;
      here = below;
    }
    xx += sum_xx.total(), xy += sum_xy.total(), yy += sum_yy.total();
  }
  const auto a = static_cast<double>(xx);
  const auto b = static_cast<double>(xy);
  const auto d = static_cast<double>(yy);
  const double pixels = static_cast<double>(window_px_) * window_px_;
  const double smaller = 0.5 * (a + d - std::sqrt((a - d) * (a - d) + 4 * b * b));
  constexpr double kUnit2 = static_cast<double>(1 << 2 * (kGradientBits + 5));
  min_eigenvalue_ = static_cast<float>(smaller / (pixels * kUnit2));
  constexpr double kGradient2 = static_cast<double>(1 << 2 * kGradientBits);
  mean_gradient_ = static_cast<float>(std::sqrt((a + d) / (2 * pixels * kGradient2)));
  // step = -G^-1 sum(g * difference), with the fixed points of gradient and value taken out.
  const double determinant = a * d - b * b;
  const double scale =
      determinant > 0 ? -std::ldexp(1.0, kGradientBits - kValueBits) / determinant : 0.0;
  Eigen::Matrix2d inverse;
  inverse << d, -b, -b, a;
  step_from_sums_ = (scale * inverse).cast<float>();
}

Eigen::Vector2f FlowPatch::step(const PaddedImage& image, const Eigen::Vector2f& at_px) const {
  std::int64_t x = 0;
  std::int64_t y = 0;
  const std::int16_t* values = around_.data() + stride_ + 1;
  for (int c = 0; c < stride_; c += kLanes) {
    Sampler sampler(image, at_px, c - half_px_, -half_px_);
    std::ptrdiff_t i = c;
    for (int first = 0; first < window_px_; first += kRowsPerSum) {
      Sums sum_x, sum_y;
      for (int r = first; r < std::min(first + kRowsPerSum, window_px_); ++r, i += stride_) {
        const Words difference = sampler.next_row() - Words::load(values + i);
        sum_x.add_products(difference, Words::load(gx_.data() + i));
        sum_y.add_products(difference, Words::load(gy_.data() + i));
      }
      x += sum_x.total();
      y += sum_y.total();
    }
  }
  return step_from_sums_ * Eigen::Vector2f(static_cast<float>(x), static_cast<float>(y));
}

FlowPatch::Difference FlowPatch::difference(const PaddedImage& image,
                                            const Eigen::Vector2f& at_px) const {
  const std::int16_t* values = around_.data() + stride_ + 1;
  std::int64_t window = 0;
  std::int64_t centre = 0;
  for (int c = 0; c < stride_; c += kLanes) {
    const Words inside = Words::load(inside_.data() + c);
    Sampler sampler(image, at_px, c - half_px_, -half_px_);
    Sums sum;
    for (int r = 0; r < window_px_; ++r) {
      const std::ptrdiff_t i = static_cast<std::ptrdiff_t>(r) * stride_ + c;
      const Words d = (sampler.next_row() - Words::load(values + i)).magnitude();
      sum.add_products(d, inside);
      if (std::abs(r - half_px_) > 1) continue;
      alignas(32) std::int16_t lanes[kLanes];
      d.store(lanes);
      for (int k = std::max(half_px_ - 1 - c, 0); k <= std::min(half_px_ + 1 - c, kLanes - 1); ++k)
        centre += lanes[k];
    }
    window += sum.total();
  }
  constexpr float kUnit = 1.0F / (1 << kValueBits);
  return {static_cast<float>(window) * kUnit / static_cast<float>(window_px_ * window_px_),
          static_cast<float>(centre) * kUnit / 9.0F};
}

}  // namespace ygslam
