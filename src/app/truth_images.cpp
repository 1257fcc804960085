#include "app/truth_images.hpp"

#include "segment/png_ids.hpp"

namespace ygslam {

namespace fs = std::filesystem;

TruthImages::TruthImages(const Sequence& sequence)
    : root_(sequence.root), width_(sequence.camera.width), height_(sequence.camera.height) {
  std::error_code ec;
  has_masks_ = fs::is_directory(root_ / "mask", ec);
  has_motion_ = has_masks_ && fs::is_directory(root_ / "moving", ec);
  for (const SequencePair& pair : sequence.pairs)
    name_[pair.stamp] = fs::path(pair.colour_file).stem().string() + ".png";
}

Result<DynamicTruth> TruthImages::read(Timestamp stamp) const {
  auto ids = read_image("mask", stamp);
  if (!ids.ok()) return ids.error();
  DynamicTruth truth{std::move(ids).value(), {}};
  if (has_motion_) {
    auto moving = read_image("moving", stamp);
    if (!moving.ok()) return moving.error();
    truth.moving = std::move(moving).value();
  }
  return truth;
}

Result<GreyImage> TruthImages::read_image(const char* folder, Timestamp stamp) const {
  const fs::path file = root_ / folder / name_.at(stamp);
  auto image = read_png_ids(file);
  if (image.ok() && (image->width() != width_ || image->height() != height_)) {
    return Error{ErrorKind::kInput, file.string() + ": is not of the colour image's size"};
  }
  return image;
}

}  // namespace ygslam
