// Where views disagree about space, the last ones decide: what others saw there is taken back. A
// pure function of the views that are fused.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "dense/fused_volume.hpp"

namespace ygslam {

struct SpaceVerdict {
  struct Cells {
    std::vector<SpaceIndex> removed;   ///< in which the view saw a surface
    std::vector<SpaceIndex> appeared;  ///< through which it saw
  };
  std::map<DenseViewId, Cells> cells;
  std::set<DenseViewId> deciding;  ///< views without which the map would show something else
};

class SpaceJudge {
 public:
  SpaceJudge(const DenseMapConfig& config, const Camera& camera)
      : config_(config), camera_(camera) {}

  /// Of the whole map, as if nothing had been taken back before.
  [[nodiscard]] SpaceVerdict judge(FusedVolume& fused) const;
  /// Of what a view observed, by the newest views.
  [[nodiscard]] SpaceVerdict judge(FusedVolume& fused, DenseViewId view) const;
  /// Whether a view views through a surface, or sees one in the air, which too few views did as
  /// yet.
  [[nodiscard]] bool is_change(const SeenSpace& observed, const SpaceLayer& space) const;

 private:
  /// @param disputed cells. @param most_views that are asked about them.
  [[nodiscard]] SpaceVerdict judge(FusedVolume& fused, const std::vector<SpaceIndex>& disputed,
                                   int most_views) const;
  [[nodiscard]] SpaceVerdict verdict_of(FusedVolume& fused, const SpaceChanges& changes) const;
  /// Whether one of the cells lies in the view's picture.
  [[nodiscard]] bool may_see(const ViewPlacement& view, const std::vector<SpaceIndex>& cells) const;
  /// By all counts something stands in such a cell, or would not be shown.
  [[nodiscard]] bool may_be_removed(SpaceCounts known) const;
  [[nodiscard]] bool may_have_appeared(SpaceCounts known) const;

  DenseMapConfig config_;
  const Camera& camera_;
};

}  // namespace ygslam
