// The volume of a set of views, and its mesh. Whatever views went in and out before: the same
// views, poses and pixel states give the same bits.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "dense/dense_config.hpp"
#include "dense/dense_frame.hpp"
#include "dense/pixel_state.hpp"

namespace ygslam {

/// A view as it is in the volume, or shall be.
struct ViewPlacement {
  std::shared_ptr<const StoredView> images;
  Timestamp stamp;
  SE3 T_world_camera;
  PixelState state;
};

class FusedVolume {
 public:
  FusedVolume(const DenseMapConfig& config, std::shared_ptr<ViewUnpacker> unpacker);

  using Placements = std::map<DenseViewId, ViewPlacement>;
  /// From now on the volume is of these views. What is in it otherwise is taken back as it was put
  /// in, what is missing is put in, as long as there are fewer than DenseMapConfig::most_views.
  void sync(const Placements& wanted);
  /// The same of one view. Where its pose differs by no more than tolerance_m of what it sees, the
  /// pose stays as it is; 0: to the bit.
  void sync(DenseViewId id, const ViewPlacement& wanted, double tolerance_m = 0);
  void remove(DenseViewId id);
  /// Puts a view in until the next sync() of all. @param view without objects.
  /// @return false where it is full.
  bool add(DepthView view, const SE3& T_world_camera);

  /// nullptr: it is not in.
  [[nodiscard]] const ViewPlacement* find(DenseViewId id) const;
  [[nodiscard]] bool contains(DenseViewId id) const { return views_.contains(id); }
  /// In ascending order.
  [[nodiscard]] std::vector<DenseViewId> ids() const;
  [[nodiscard]] bool is_full() const { return volume_.views() >= config_.most_views; }
  /// The view's pixels as they were put in.
  [[nodiscard]] DepthView pixels(DenseViewId id) { return pixels_of(views_.at(id).placement); }
  /// What the view observed of space by itself, whatever was removed or appeared since but objects.
  [[nodiscard]] const SeenSpace& observed_space(DenseViewId id);
  /// The same of a view that is not in. @return until the next change.
  [[nodiscard]] const SeenSpace& observe(const ViewPlacement& view);

  [[nodiscard]] const Volume& volume() const { return volume_; }
  /// SpaceLayer::take_changed().
  [[nodiscard]] std::vector<BlockKey> take_changed_space() { return volume_.take_changed_space(); }
  [[nodiscard]] TriangleMesh mesh();
  /// Of the volume, its mesh and what is known of views' space.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct ObservedSpace {
    SeenSpace space;
    SE3 T_world_camera;
    PixelState state;
    [[nodiscard]] bool is_of(const SE3& T_world_now, const PixelState& state_now) const;
  };
  struct View {
    ViewPlacement placement;
    std::optional<ObservedSpace> observed;
    std::optional<SeenSpace>
        counted;  // what it was put in with, where that is not what it observed
  };
  using Views = std::map<DenseViewId, View>;

  [[nodiscard]] DepthView pixels_of(const ViewPlacement& placement);
  [[nodiscard]] const SeenSpace& observed_space(View& view);
  /// What it was put in with, which it no longer knows by itself afterwards.
  [[nodiscard]] SeenSpace take_counted_space(View& view);
  /// Exchanges the cells that a view must not carve, if it differs in nothing else of its pixels.
  void exchange_appeared(View& view, const PixelState& wanted);
  /// Exchanges its pixels for what is known of them now; its pose stays.
  void exchange_pixels(View& view, const ViewPlacement& wanted);
  /// @param known what the view observed, as far as that was known.
  void put_in(DenseViewId id, const ViewPlacement& wanted, std::optional<ObservedSpace> known);
  /// @return what the view observed, as far as that was known.
  std::optional<ObservedSpace> take_back(Views::iterator view);
  [[nodiscard]] Views start_again();

  DenseMapConfig config_;
  std::shared_ptr<ViewUnpacker> unpacker_;
  Volume volume_;
  Mesher mesher_;
  int min_views_;  // that the mesher asks for
  Views views_;
};

}  // namespace ygslam
