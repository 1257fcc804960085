// `ygslam inspect`, the running: one check over a whole sequence, its counts and its pictures.
#pragma once

#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/run_options.hpp"
#include "app/truth_images.hpp"
#include "eval/dynamic_score.hpp"
#include "eval/tracking_score.hpp"

namespace ygslam {

struct InspectOptions {
  RunOptions run;
  std::vector<std::size_t> frames;
  std::vector<std::string> checks{"classic", "improved", "full"};
  std::string loops;  ///< folder of a run, whose loops.csv to judge in place of the checks
  bool json = false;
  bool live = false;  ///< threads, masks when they come; else offline, on one schedule
};

/// One way to tell dynamic points, and how it did.
struct Check {
  std::string name;
  SlamConfig config;
  PointCounts points;
  MaskOverlap mask;
  std::vector<BoxFrame> objects;              ///< per frame
  std::map<std::uint32_t, cv::Mat> pictures;  ///< by number of the frame, RGB
};

/// @param name classic, improved or full.
[[nodiscard]] Check make_check(const std::string& name, const SlamConfig& base);

class Inspection {
 public:
  /// @param options must outlive it.
  Inspection(const InspectOptions& options, Sequence sequence);

  /// Whether there are masks beside the sequence to compare with.
  [[nodiscard]] bool has_truth() const { return truth_.available(); }
  /// @return kModel where the check needs a network and none was given, before others run.
  [[nodiscard]] Status ready(const Check& check) const;
  /// Runs the whole sequence once, until it ends or a stop is asked for.
  /// @return kModel, kConfig or kInput: no session, or truth that cannot be read.
  Status run(Check& check);

 private:
  [[nodiscard]] Result<SessionOptions> session_options(const Check& check) const;
  void draw(const RgbdFrame& frame, const TrackResult& result,
            const std::optional<DynamicTruth>& truth, Check& check) const;

  const InspectOptions& options_;
  Sequence sequence_;
  TruthImages truth_;
  std::set<std::size_t> shown_;
};

}  // namespace ygslam
