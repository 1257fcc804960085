#include "segment/given_masks.hpp"

#include <utility>

namespace ygslam {
namespace {

class GivenSegmenter final : public Segmenter {
 public:
  explicit GivenSegmenter(std::shared_ptr<GivenMasks> masks) : masks_(std::move(masks)) {}

  Result<Segmentation> segment(const RgbdFrame& frame) override {
    const SegmentationPtr given = masks_->take(frame.id);
    if (!given) return Error{ErrorKind::kInput, "a frame came without instances"};
    return *given;
  }
  [[nodiscard]] std::string precision() const override { return "given"; }
  [[nodiscard]] bool in_step() const override { return true; }

 private:
  std::shared_ptr<GivenMasks> masks_;
};

}  // namespace

void GivenMasks::put(SegmentationPtr masks) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(masks));
  if (waiting_.size() > kMost) waiting_.pop_front();
}

SegmentationPtr GivenMasks::take(FrameId frame) {
  const std::lock_guard lock(mutex_);
  while (!waiting_.empty() && index(waiting_.front()->frame) < index(frame)) waiting_.pop_front();
  if (waiting_.empty() || waiting_.front()->frame != frame) return nullptr;
  SegmentationPtr masks = std::move(waiting_.front());
  waiting_.pop_front();
  return masks;
}

std::unique_ptr<Segmenter> make_given_segmenter(std::shared_ptr<GivenMasks> masks) {
  return std::make_unique<GivenSegmenter>(std::move(masks));
}

}  // namespace ygslam
