// The motion that lays an estimated trajectory over the true one.
#pragma once

#include <optional>
#include <string_view>

#include "eval/associate.hpp"

namespace ygslam {

enum class AlignMode {
  kSe3,    ///< rotation and translation, least squares over all positions
  kSim3,   ///< with scale
  kFirst,  ///< the first poses coincide
  kNone,   ///< as they are
};
[[nodiscard]] std::optional<AlignMode> parse_align_mode(std::string_view name);
[[nodiscard]] std::string_view name_of(AlignMode mode);

struct Alignment {
  SE3 T_truth_estimate;  ///< p_truth = R * (scale * p_estimate) + t
  double scale = 1.0;
  bool truth_without_extent = false;  ///< rotation and scale could not be seen and were left alone

  [[nodiscard]] SE3 apply(const SE3& T_estimate_camera) const {
    const SE3 scaled(T_estimate_camera.R(), scale * T_estimate_camera.t());
    return T_truth_estimate * scaled;
  }
};

/// A truth whose positions stay within this (root mean square about their mean) does not move.
inline constexpr double kNoExtent_m = 1e-3;

/// Least squares after Umeyama 1991, eqs. (39) to (42), and Horn's variant without scale. Where the
/// truth does not move (a static camera) the positions hold no direction: the rotation stays
/// identity and the centroids are aligned.
/// @param pairs at least one.
[[nodiscard]] Alignment align(const PosePairs& pairs, AlignMode mode);

/// For what cameras see far away: the rotation is the (chordal) mean over all pairs, the
/// translation the mean after it. Positions alone hold the rotation badly where a camera hardly
/// moves: 2 mm over 30 cm turn a wall 4 m away by 3 cm. Scale 1. @param pairs at least one.
[[nodiscard]] Alignment align_with_orientations(const PosePairs& pairs);

}  // namespace ygslam
