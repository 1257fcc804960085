// A dense keyframe's images in little memory, for the day its pose is corrected.
#pragma once

#include <string>

#include "volume/depth_view.hpp"

namespace ygslam {

/// Depth and objects come back as they were; colours are kept to 5, 6 and 5 bits.
class StoredView {
 public:
  /// @param view is given the colours that will come back: what is fused is what is kept.
  explicit StoredView(DepthView& view);

  [[nodiscard]] DepthView restored() const;
  [[nodiscard]] std::size_t bytes() const { return packed_.size(); }

 private:
  Pinhole camera_;
  std::vector<SceneObjectId> objects_;
  std::string packed_;
};

}  // namespace ygslam
