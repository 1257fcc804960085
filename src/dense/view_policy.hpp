// Which frames between keyframes enter the dense map, and which are removed again when others show
// the same. Keyframes always stay.
#pragma once

#include <map>
#include <vector>

#include "dense/pixel_judge.hpp"
#include "dense/surface_sample.hpp"

namespace ygslam {

class ViewPolicy {
 public:
  ViewPolicy(const DenseMapConfig& config, std::shared_ptr<ViewUnpacker> unpacker);

  /// A frame that neither enters nor is left out yet.
  [[nodiscard]] bool is_undecided(DenseViewId id, const DenseView& view) const {
    return view.anchor && !entered_.contains(id);
  }
  /// Whether a frame that has a place shows something that the map does not know well; then it
  /// enters.
  bool enters(DenseViewId id, const DenseView& view, const PixelJudge& judge, FusedVolume& fused);
  /// Whatever it shows.
  void enter(DenseViewId id, const std::shared_ptr<const StoredView>& images);
  void forget(DenseViewId id) { entered_.erase(id); }

  /// The next few views after those of the last call, to ask whether they are needed.
  [[nodiscard]] std::vector<DenseViewId> next_views(const ViewStore& views);
  /// Whether the map shows the same without the frame.
  [[nodiscard]] bool is_needless(DenseViewId id, const PixelJudge& judge,
                                 const FusedVolume& fused) const;
  /// Of more frames near this pose than a place may have, those that show least of what others do
  /// not: noise makes each of them look a little new, for ever.
  [[nodiscard]] std::vector<DenseViewId> crowded_out(const SE3& T_world_camera,
                                                     const PixelJudge& judge,
                                                     const FusedVolume& fused) const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  [[nodiscard]] bool shows_new(const DenseView& view, const SurfaceSample& sample,
                               const PixelJudge& judge, FusedVolume& fused) const;
  /// The frame's surface, if it entered, is in, and not protected any more.
  [[nodiscard]] const SurfaceSample* removable(DenseViewId id, const PixelJudge& judge,
                                               const FusedVolume& fused) const;
  [[nodiscard]] double share_of_its_own(const SurfaceSample& sample, const SE3& T_world_camera,
                                        const FusedVolume& fused) const;
  [[nodiscard]] bool shows_rare_object(const PixelState& state, const ObjectMap& objects) const;

  DenseMapConfig config_;
  std::shared_ptr<ViewUnpacker> unpacker_;
  std::map<DenseViewId, SurfaceSample> entered_;
  DenseViewId last_asked_{KeyframeId{0}};
};

}  // namespace ygslam
