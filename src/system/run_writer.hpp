// The files of a run (contract: "Output of run").
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "io/atomic_file.hpp"
#include "io/frame_queue.hpp"
#include "io/trajectory.hpp"
#include "system/runner.hpp"

namespace ygslam {

/// Final poses of the frames, with the map's corrected keyframes, their centres on a smooth path.
[[nodiscard]] std::vector<StampedPose> final_trajectory(const Trajectory& trajectory,
                                                        const RevisedPoses& revised,
                                                        const Map& map);
[[nodiscard]] std::vector<StampedPose> keyframe_trajectory(const Map& map);

/// The files that grow with the run, written as it goes on: frames.csv (a line per frame),
/// objects.csv (a line per frame and object, in the live world frame) and trajectory_live.txt
/// (poses as they were delivered). Nothing is seen of them before commit(). The poses that later
/// corrections will move grow in a file, too, not in memory.
class FrameFiles {
 public:
  /// @param with_times false: the *_ms columns stay empty, so that two deterministic runs give the
  /// same bytes.
  /// @param with_covariance trajectory_live.txt has covariances, and odometry.txt is written.
  static Result<FrameFiles> create(const std::filesystem::path& directory, int stamp_decimals,
                                   bool with_times, bool with_covariance = false);
  /// After the first fault, which commit() tells, nothing more is written.
  void add(const FrameRecord& record, std::span<const RetrackedFrame> retracked = {});
  /// A frame that nobody saw has a row of frames.csv only.
  void add_missed(const OfferedFrame& missed);
  /// Of the tracked frames so far, for final_trajectory().
  [[nodiscard]] Result<Trajectory> trajectory();
  /// Adds those that were placed again during the run.
  [[nodiscard]] Result<RevisedPoses> revised(const Map& map, RevisedPoses others);
  [[nodiscard]] Status commit();

 private:
  FrameFiles(std::filesystem::path directory, int stamp_decimals, bool with_times,
             bool with_covariance);
  /// A file without a name until it is whole: whatever ends the program leaves nothing behind.
  struct Growing {
    std::string name;
    std::string waiting;  ///< not yet written
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file{nullptr, &std::fclose};
  };
  [[nodiscard]] Status open(Growing& growing) const;
  [[nodiscard]] Status flush(Growing& growing) const;
  [[nodiscard]] Status copy(Growing& growing) const;
  void put(Growing& growing, std::string_view text);

  std::filesystem::path directory_;
  Growing frames_, objects_, live_, odometry_;
  template <typename Entry>
  void put_bytes(Growing& growing, const Entry& entry);
  /// Calls `take` with what put_bytes() put there.
  template <typename Entry, typename Take>
  [[nodiscard]] Status read(Growing& growing, Take take);

  Growing poses_, retracked_;  // PosedFrame by PosedFrame, RetrackedPose; nobody else reads them
  int stamp_decimals_;
  bool with_times_, with_covariance_;
  Status state_ = Ok{};
};

/// `loops.csv`: what keyframes were compared with to close loops, and why not where they were not.
[[nodiscard]] std::string loops_csv(std::span<const LoopAttempt> attempts, int stamp_decimals);

/// trajectory.txt, keyframes.txt and map.ply, each atomically.
[[nodiscard]] Status write_run(const std::filesystem::path& directory,
                               std::span<const StampedPose> trajectory, const Map& map,
                               std::span<const ColouredPoint> cloud, int stamp_decimals);

}  // namespace ygslam
