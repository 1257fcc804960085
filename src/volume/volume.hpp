// The dense map's volume: a surface layer and a space layer that are a pure function of the views
// put into them and their poses. integrate() and deintegrate() are exact opposites: whatever the
// order and whatever came between, the same set of (view, pose) gives the same bits, for any
// number of threads.
#pragma once

#include <cstddef>
#include <cstdint>

#include "volume/depth_view.hpp"
#include "volume/prepared_view.hpp"
#include "volume/space_layer.hpp"
#include "volume/surface_layer.hpp"

namespace ygslam {

struct VolumeConfig {
  SurfaceConfig surface;
  SpaceConfig space;
  PreparationConfig preparation;
  int threads = 1;  ///< that work on one view, the caller's included
};

/// Not for several threads at once, except for reading.
class Volume {
 public:
  /// Sums of more views than this could overflow.
  static constexpr int kMaxViews = 4096;

  explicit Volume(const VolumeConfig& config);

  /// Adds what a view at a pose contributes; there must be fewer than kMaxViews. The pose is
  /// finite and within 10^6 cells and half as many blocks of the world's origin (50 km at 5 cm).
  /// @return what it says of space, until the next call.
  const SeenSpace& integrate(const DepthView& view, const SE3& T_world_camera);
  /// Takes it back: the same view at the same pose, to the bit, as was integrated.
  void deintegrate(const DepthView& view, const SE3& T_world_camera);
  /// The same, faster. @param seen what integrate() returned for it.
  void deintegrate(const DepthView& view, const SE3& T_world_camera, const SeenSpace& seen);
  /// Both, for a view of whose image other pixels count by now; its pose stays.
  /// @param seen what integrate() returned for `old`. @return what `now` says of space.
  const SeenSpace& exchange(const DepthView& old, const SeenSpace& seen, const DepthView& now,
                            const SE3& T_world_camera);
  /// Both, for a view whose pose was corrected.
  void move(const DepthView& view, const SE3& T_world_camera_old, const SE3& T_world_camera_new);
  /// Takes all of them back at once; the memory stays for what comes.
  void clear();
  /// Of a view that is in it: exchanges the cells that it does not carve.
  /// @param seen what integrate() returned for it. @param old its DepthView::spared then.
  void exchange_spared(const SeenSpace& seen, const std::vector<Eigen::Vector3i>& old,
                       const std::vector<Eigen::Vector3i>& now);
  /// What integrate() would return; nothing is put in.
  [[nodiscard]] const SeenSpace& observe(const DepthView& view, const SE3& T_world_camera);

  [[nodiscard]] const VolumeConfig& config() const { return config_; }
  /// How many are in it.
  [[nodiscard]] int views() const { return views_; }
  [[nodiscard]] const SurfaceLayer& surface() const { return surface_; }
  [[nodiscard]] const SpaceLayer& space() const { return space_; }
  [[nodiscard]] std::vector<BlockKey> take_changed_space() { return space_.take_changed(); }
  /// Of both layers, votes, tables and pools included.
  [[nodiscard]] std::size_t memory_bytes() const;
  /// Equal for equal contents.
  [[nodiscard]] std::uint64_t fingerprint() const;

 private:
  const SeenSpace& fuse(const SE3& T_world_camera, int sign);

  VolumeConfig config_;
  SurfaceLayer surface_;
  SpaceLayer space_;
  SpaceScan scan_;
  PreparedView prepared_, prepared_before_;
  int views_ = 0;
};

/// What a volume would take. Per m2 of surface, recordings took .7 (walls nearby) to 1.5 times (a
/// room seen from afar) as much.
/// @param surface_m2 area of all surfaces. @param space_m3 that is seen.
[[nodiscard]] double estimated_bytes(const VolumeConfig& config, double surface_m2,
                                     double space_m3);
/// The same of a furnished room. @param room_m its length, width and height [m].
[[nodiscard]] double estimated_bytes(const VolumeConfig& config, const Vec3& room_m);

}  // namespace ygslam
