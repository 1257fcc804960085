// Finds screens that play. A video that pans looks like a camera that moves: the points on it agree
// with each other, and where the rest of the room is far, one wrong motion explains both. Then two
// motions are rivals: that of all points, and that of the points beside a plane. Depth decides
// between them, and where the second wins what is on the plane moves. Where too few points are
// beside it, the pose that depth alone has is the second.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "features/pyramid_scales.hpp"
#include "map/observation_noise.hpp"
#include "optim/pose_only.hpp"
#include "tracking/depth_agreement.hpp"
#include "tracking/frame_features.hpp"
#include "tracking/known_screens.hpp"
#include "tracking/planar_patches.hpp"

namespace ygslam {

class ScreenFinder {
 public:
  ScreenFinder(const Camera& camera, const PyramidScales& scales, const NoiseConfig& noise)
      : camera_(camera), scales_(scales), noise_(noise) {}

  /// A feature with depth whose place in the world is known from frames before.
  struct Point {
    std::uint32_t feature;
    Vec3 p_world;
    bool mapped;  ///< by the map, else by the frame before
  };
  struct Place {
    const FrameFeatures& now;
    SE3 T_camera_world;  ///< as all points have it
    SE3 T_odom_camera;   ///< the same in the frame that never jumps
  };
  struct Finding {
    KnownScreens::Sighting screen;
    SE3 T_camera_world;  ///< as the points beside it have it
    bool moves_camera;   ///< whether that is another pose
  };
  struct Output {
    std::optional<Finding> found{};
    bool undecided = false;  ///< two poses, and depth does not tell which is right
    double covered = 0;      ///< share of the points that lie on one plane, where it was asked
    double conflict = 0;     ///< how far depth contradicts the pose; noise is 5, seldom 20
  };
  /// @param moving how many points seem to move, of what is not known to be able to.
  /// @param points of nothing that is known to be able to move; asked for where they are needed.
  [[nodiscard]] Output step(const Place& place, int moving,
                            const std::function<std::vector<Point>()>& points);

  /// Where depth alone has the camera since the anchor.
  struct ByDepth {
    SE3 T_camera_world;
    DepthAgreement agreement;
    double apart_m;  ///< from where it was asked about, at the points of the anchor
  };
  /// @return nullopt if depth, too, changed in other ways than by a camera that moves.
  [[nodiscard]] std::optional<ByDepth> by_depth(const Place& place, const SE3& T_start_world) const;
  /// The pose that depth and the points that gave it agree with best.
  /// @param information of the points at T_points_world, of a left perturbation.
  [[nodiscard]] SE3 with_depth(const Place& place, const SE3& T_points_world,
                               const Mat6& information) const;
  /// Where the frame was in the end: later ones are compared with its depth.
  void remember(const FrameFeatures& now, const SE3& T_odom_camera);
  /// The camera was lost.
  void forget();

 private:
  struct Input {
    const Place& place;
    std::span<const Point> points;
    std::optional<SE3> T_depth_world{};  // T_camera_world by depth alone, if it is another
  };
  /// The points, taken apart into those on one plane and those beside it.
  struct Hypothesis {
    SE3 T_camera_world;                 // by the points beside the plane
    std::vector<std::uint32_t> moving;  // of the points on it: indices
    bool moves_camera = false;
    double share_moving = 0;  // of the points on the plane
  };
  [[nodiscard]] std::optional<SE3> rival_by_depth(const Place& place, const DepthAgreement& by_all,
                                                  double conflict);
  [[nodiscard]] bool is_suspect(double conflict, int moving);
  [[nodiscard]] SE3 T_anchor_world(const Place& place) const;
  [[nodiscard]] DepthAgreement agreement(const Place& place, const SE3& T_camera_world) const;
  [[nodiscard]] bool stood_before(const Place& place, const Finding& found) const;
  [[nodiscard]] Finding finding(const Input& in, const Hypothesis& rival, const Vec3& plane) const;
  [[nodiscard]] Output search(const Input& in) const;
  [[nodiscard]] std::vector<int> patches_of(const Input& in, const PlanarPatches& patches) const;
  [[nodiscard]] double decisive_cost(const Place& place, const SE3& T_camera_world) const;
  [[nodiscard]] std::optional<PoseSolution> pose_beside(const Input& in,
                                                        std::span<const int> patch_of,
                                                        int patch) const;
  [[nodiscard]] Hypothesis split(const Input& in, std::span<const int> patch_of, int patch,
                                 const SE3& T_camera_world) const;
  [[nodiscard]] std::optional<Hypothesis> without_by_depth(const Input& in,
                                                           std::span<const int> patch_of,
                                                           int patch) const;
  [[nodiscard]] std::optional<Hypothesis> without(const Input& in, std::span<const int> patch_of,
                                                  int patch) const;
  [[nodiscard]] double shift_px(const Input& in, std::span<const int> patch_of, int patch,
                                const Hypothesis& rival) const;
  [[nodiscard]] std::vector<double> residuals_px(const Input& in, const SE3& T_camera_world) const;

  const Camera& camera_;
  PyramidScales scales_;
  NoiseConfig noise_;
  DepthSamples anchor_;
  FramePtr anchor_frame_;
  SE3 T_odom_anchor_;
  int anchor_age_frames_ = 0;
  SE3 T_odom_last_;                  // the last frame, as it was placed in the end ...
  SE3 T_placed_depth_;               // ... and depth has it, from there
  std::optional<SE3> T_odom_depth_;  // this frame, as depth has it
  bool in_doubt_ = false;            // depth begins to have it elsewhere
  int pause_frames_ = 0;             // after a search that found nothing
  int waited_frames_ = 0;
  double fruitless_conflict_ = 0;
};

}  // namespace ygslam
