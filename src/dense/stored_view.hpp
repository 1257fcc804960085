// A dense view's images in little memory, for the day its pose is corrected.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "volume/depth_view.hpp"

namespace ygslam {

/// Depth and objects come back as they were; colours are kept to 5, 6 and 5 bits.
class StoredView {
 public:
  /// @param view is given the colours that will come back: what is fused is what is kept.
  explicit StoredView(DepthView& view);
  /// Of what packed() gave. @return nothing where that is no view of this camera, or one of other
  /// objects.
  [[nodiscard]] static std::optional<StoredView> from_parts(const Pinhole& camera,
                                                            std::vector<SceneObjectId> objects,
                                                            std::string packed);

  [[nodiscard]] DepthView restored() const;
  [[nodiscard]] std::size_t bytes() const { return packed_.size(); }
  [[nodiscard]] const std::vector<SceneObjectId>& objects() const { return objects_; }
  [[nodiscard]] const std::string& packed() const { return packed_; }

 private:
  StoredView() = default;
  Pinhole camera_;
  std::vector<SceneObjectId> objects_;
  std::string packed_;
};

/// Unpacks views; the last one stays, since it is mostly asked for again.
class ViewUnpacker {
 public:
  /// @return until the next call.
  const DepthView& unpacked(const std::shared_ptr<const StoredView>& stored) {
    if (stored_ != stored) keep(stored, stored->restored());
    return view_;
  }
  /// Of a view that was just packed.
  void keep(std::shared_ptr<const StoredView> stored, DepthView view) {
    stored_ = std::move(stored);
    view_ = std::move(view);
  }

 private:
  std::shared_ptr<const StoredView> stored_;
  DepthView view_;
};

}  // namespace ygslam
