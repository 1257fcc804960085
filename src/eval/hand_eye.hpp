// The constant transform between two bodies that moved as one: a marker's, say, and a camera's.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "eval/associate.hpp"

namespace ygslam {

/// One motion as both bodies made it: A X = X B, with X = T_body_camera.
struct BodyMotion {
  SE3 body;    ///< A, T_before_after of the body
  SE3 camera;  ///< B, the same of the camera
};

/// Least squares, robust against motions that do not fit (Cauchy weights). The rotation by Park and
/// Martin 1994, eqs. (13) to (18): the one that turns the camera's rotation vectors into the
/// body's; the translation by linear least squares, (R_A - I) t = R t_B - t_A. Where all rotations
/// have one axis, the turn about it comes from the translations. Directions of the offset that the
/// motion does not show to 0.1 m are 0: along the only axis of rotation it makes no difference.
/// @param overlap how many motions follow each other within one: they are not independent.
/// @return nothing if the motion does not show the rotation to 5 degrees.
[[nodiscard]] std::optional<SE3> solve_hand_eye(std::span<const BodyMotion> motions,
                                                double overlap = 1);

/// Motions over a second or so, at most 2000.
[[nodiscard]] std::vector<BodyMotion> motions_of(const PosePairs& pairs);

/// X where the truth is that of another body than the estimate. It must explain the errors of
/// motions it was not found from (four blocks of time, each predicted from the other three): the
/// median error of rotation or of translation falls to a third or less, the other does not grow.
/// A few degrees between a tracking system's camera and the real one, which recordings have, stay.
/// @param pairs the estimate with its scale corrected. @return nothing where the bodies are one, or
/// the motion does not show it.
[[nodiscard]] std::optional<SE3> find_body_offset(const PosePairs& pairs);

/// Whether the truth moves as in a mirror. M T M turns rotation vectors by -M, a rotation, and
/// translations by M: with the rotation that fits the former, the latter are the opposite (three
/// times less error). It shows only where the camera turns about more than one axis.
[[nodiscard]] bool is_mirrored(const PosePairs& pairs);

/// The poses behind a mirror that turns y over, in the world and in the camera: M T M with
/// M = diag(1, -1, 1). ICL-NUIM's truth becomes that of a camera with y down.
[[nodiscard]] std::vector<StampedPose> mirrored(std::span<const StampedPose> poses);

/// How the poses of a file may be meant otherwise than they were read.
enum class PoseReading {
  kAsRead,
  kWFirst,         ///< quaternions qw qx qy qz
  kWLast,          ///< quaternions qx qy qz qw, where qw was read first
  kInverse,        ///< T_camera_world
  kInverseWFirst,  ///< both
};
[[nodiscard]] std::vector<StampedPose> read_otherwise(std::span<const StampedPose> poses,
                                                      PoseReading reading);

/// Of whose file quaternions were read as qw qx qy qz, so that they may have qw last.
struct WFirst {
  bool truth = false, estimate = false;
};

struct BetterReading {
  PoseReading reading = PoseReading::kAsRead;
  bool fits_truth = false, fits_estimate = false;  ///< of which file; both: of one of them
};
/// The reading in which the motions of truth and estimate agree, with a constant transform between
/// the bodies, three times better than as given in rotation or translation, the other no worse. A
/// quaternion with its w at the other end turns as the inverse rotation does, so that turns about
/// one axis alone may not show it.
/// @return kAsRead where they agree as given, in no reading, or best in a mirror.
[[nodiscard]] BetterReading better_reading(const PosePairs& pairs, WFirst w_first = {});

/// The truth as that of the estimate's body; as it is where find_body_offset() finds nothing.
[[nodiscard]] std::vector<StampedPose> truth_of_camera(std::span<const StampedPose> truth,
                                                       std::span<const StampedPose> estimate,
                                                       double max_diff_s);

}  // namespace ygslam
