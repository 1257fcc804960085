// Finds out about the camera while tracking: when its rows are read, how late its depth is, focal
// length and centre, the bias of its depth. A feature of a frame and the same landmark's in a
// keyframe lie in other rows, at other places and depths, and the camera moved otherwise: how far
// each parameter shifts the one against the other is known to first order. Per pair of frames the
// camera's motion between them and the parameters are solved for by least squares; the motion is
// eliminated (Schur complement), and what is left is summed over the pairs. What the parameters do
// to landmarks and poses of the map plays no part.
//
// The scale of depth cannot be found: a world twice as large, seen by a camera that moves twice as
// far, looks the same.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/time.hpp"
#include "map/local_view.hpp"
#include "tracking/tracked_frame.hpp"

namespace ygslam {

enum class CameraParameter : std::uint8_t {
  kReadout,        ///< [s] of colour and depth, taken as equal
  kColourReadout,  ///< [s] see ShutterTimes
  kDepthReadout,   ///< [s]
  kDepthDelay,     ///< [s]
  kFocalLength,    ///< true / used - 1, of fx and fy
  kCentreX,        ///< true - used [px]
  kCentreY,        ///< [px]
  kDepthBias,      ///< b of true depth = measured (1 + b measured) [1/m]
};

class CameraEstimator {
 public:
  using Parameters = Eigen::VectorXd;

  CameraEstimator(const Camera& camera, std::vector<CameraParameter> parameters)
      : camera_(camera), parameters_(std::move(parameters)) {}

  struct Estimate {
    Parameters value;  ///< one per parameter
    /// Standard deviations, from how far parts of the recording of half a second disagree.
    Parameters std;
    /// What residuals that do not average out may add to the values, however long the recording, in
    /// units of `value`: large where the motion is calm.
    Parameters systematic;
    int parts = 0;
  };

  /// @param frame one that was tracked without a gap.
  void add(const TrackedFrame& frame);
  /// @return nullopt before there are a few parts to compare, or if the motion tells nothing.
  [[nodiscard]] std::optional<Estimate> estimate() const;
  /// Forgets all.
  void clear();

 private:
  struct Part {
    Eigen::MatrixXd H;     // information on the parameters
    Parameters g;          // the same times the parameters
    double residuals = 0;  // how many
    bool empty() const { return H.size() == 0; }
    void operator+=(const Part& other);
  };
  [[nodiscard]] std::optional<Part> compare(const TrackedFrame& frame,
                                            const ViewKeyframe& keyframe) const;
  void close_part();

  const Camera& camera_;
  std::vector<CameraParameter> parameters_;
  double part_s_ = 0.5;
  bool skip_ = false;  // neighbouring frames tell the same
  std::optional<Timestamp> part_began_;
  Part part_;
  std::vector<Part> parts_;  // of bounded number: they grow longer instead
};

}  // namespace ygslam
