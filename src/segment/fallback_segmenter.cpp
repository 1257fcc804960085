#include "segment/fallback_segmenter.hpp"

#include <atomic>
#include <utility>

#include "core/time.hpp"

namespace ygslam {
namespace {

class FallbackSegmenter final : public Segmenter {
 public:
  FallbackSegmenter(std::unique_ptr<Segmenter> first,
                    std::function<Result<std::unique_ptr<Segmenter>>()> make_second,
                    const FallbackConfig& config)
      : config_(config),
        precision_(first->precision()),
        in_step_(first->in_step()),
        used_(std::move(first)),
        make_second_(std::move(make_second)) {}

  Result<Segmentation> segment(const RgbdFrame& frame) override {
    const ScopedTimer timer;
    Result<Segmentation> masks = used_->segment(frame);
    if (masks.ok()) masks->by_fallback = is_second_;
    if (make_second_) judge(1e-3 * timer.wall_ms());
    return masks;
  }
  [[nodiscard]] std::string precision() const override { return precision_; }
  [[nodiscard]] bool in_step() const override { return in_step_.load(); }

 private:
  void judge(double took_s) {
    late_ = took_s > config_.late_s ? late_ + 1 : 0;
    if (late_ < config_.late_masks) return;
    auto second = std::exchange(make_second_, nullptr)();
    if (!second.ok()) return;
    used_ = std::move(*second);
    is_second_ = true;
    in_step_.store(used_->in_step());
  }

  const FallbackConfig config_;
  const std::string precision_;
  std::atomic<bool> in_step_;
  std::unique_ptr<Segmenter> used_;
  std::function<Result<std::unique_ptr<Segmenter>>()> make_second_;  // empty once it was asked
  bool is_second_ = false;
  int late_ = 0;  // masks in a row
};

}  // namespace

std::unique_ptr<Segmenter> make_fallback_segmenter(
    std::unique_ptr<Segmenter> first,
    std::function<Result<std::unique_ptr<Segmenter>>()> make_second, const FallbackConfig& config) {
  return std::make_unique<FallbackSegmenter>(std::move(first), std::move(make_second), config);
}

}  // namespace ygslam
