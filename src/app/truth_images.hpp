// Truth of which pixels move, beside a sequence: mask/STAMP.png and, of rendered ones,
// moving/STAMP.png.
#pragma once

#include <filesystem>
#include <map>

#include "core/result.hpp"
#include "core/time.hpp"
#include "eval/dynamic_score.hpp"
#include "io/sequence.hpp"

namespace ygslam {

class TruthImages {
 public:
  explicit TruthImages(const Sequence& sequence);
  [[nodiscard]] bool available() const { return has_masks_; }
  /// @return kInput, with file and fault: an image that is missing, unreadable or of another size.
  [[nodiscard]] Result<DynamicTruth> read(Timestamp stamp) const;

 private:
  [[nodiscard]] Result<GreyImage> read_image(const char* folder, Timestamp stamp) const;

  std::filesystem::path root_;
  int width_, height_;
  bool has_masks_, has_motion_;
  std::map<Timestamp, std::string> name_;  // file name of each frame's images
};

}  // namespace ygslam
