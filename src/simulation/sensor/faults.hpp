// Faults on demand, written as stream:kind[=value]@START+DURATION, e.g. "depth:stuck@12s+2s".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "core/rng.hpp"
#include "core/time.hpp"
#include "image/image.hpp"

namespace ygslam::sim {

enum class Stream { kColour, kDepth, kBoth };
enum class FaultKind {
  kOff,           ///< no image arrives
  kStuck,         ///< the image from before the fault again and again, under new stamps
  kGarbage,       ///< random pixels
  kScale,         ///< depth times `value`
  kSlow,          ///< only every `value`-th image arrives
  kDelayed,       ///< images show what was `value` seconds ago
  kIntermittent,  ///< each image is missing with probability `value`
  kDrop,          ///< whole frames are missing with probability `value`
  kDisorder,      ///< neighbouring stamps change places
  kBlack,
  kWhite,
  kTruncate,  ///< the file ends early (files only)
  kEmpty,     ///< pixels without a measurement, black ones in colour; value: their share
};

struct Fault {
  Stream stream = Stream::kBoth;
  FaultKind kind = FaultKind::kOff;
  double value = 0;  ///< meaning depends on the kind
  double from_s = 0;
  double duration_s = 1;
  [[nodiscard]] bool covers(double t_s) const { return t_s >= from_s && t_s < from_s + duration_s; }
};

/// @return kUsage with the grammar if the text is no fault.
[[nodiscard]] Result<Fault> parse_fault(const std::string& text);

/// What arrives of one frame.
struct Delivery {
  bool frame = true;  ///< false: nothing of it arrives
  bool colour = true;
  bool depth = true;
  bool truncate_colour = false;
  bool truncate_depth = false;
  Timestamp stamp;  ///< as written, perhaps disordered
};

/// Applies faults to a stream of images; keeps what stuck and delayed images need.
class FaultInjector {
 public:
  FaultInjector(std::vector<Fault> faults, double frame_s, std::uint64_t seed);

  /// @param index number of the frame. @param t_s its time since the start.
  [[nodiscard]] Delivery apply(int index, double t_s, Timestamp stamp, ColourImage& colour,
                               DepthImage& depth_m);
  [[nodiscard]] bool idle() const { return faults_.empty(); }

 private:
  void apply_one(const Fault& fault, int index, ColourImage& colour, DepthImage& depth_m,
                 Delivery& delivery, Rng& rng);

  std::vector<Fault> faults_;
  double frame_s_;
  std::uint64_t seed_;
  std::size_t history_frames_ = 1;
  std::vector<ColourImage> colours_;  // latest last; as they were without faults
  std::vector<DepthImage> depths_m_;
  ColourImage stuck_colour_;
  DepthImage stuck_depth_m_;
};

}  // namespace ygslam::sim
