#include "eval/error_series.hpp"

#include "core/log.hpp"  // brings {fmt}: numbers look the same in every locale
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr int kStampDecimals = 9;  // loses nothing

// Walks through the intervals in step with the rows.
class RelativeCells {
 public:
  explicit RelativeCells(const RelativeSeries& series) : series_(series) {}
  std::string next(std::size_t row) {
    if (at_ >= series_.intervals.size() || series_.intervals[at_].first != row) return ",,";
    const std::size_t i = at_++;
    return fmt::format(",{:.9f},{:.9f}", series_.errors.trans_m[i], series_.errors.rot_deg[i]);
  }

 private:
  const RelativeSeries& series_;
  std::size_t at_ = 0;
};

std::string position(const StampedPose& pose) {
  const Vec3& t = pose.T_world_camera.t();
  return fmt::format(",{:.9f},{:.9f},{:.9f}", t.x(), t.y(), t.z());
}

}  // namespace

std::string error_rows(const ErrorSeries& series, const std::string& prefix) {
  std::string text;
  RelativeCells frames(series.frames);
  RelativeCells seconds(series.seconds);
  for (std::size_t i = 0; i < series.pairs.size(); ++i) {
    const StampedPose& estimate = series.pairs.estimate[i];
    text += prefix + format_stamp(estimate.stamp, kStampDecimals) + position(estimate) +
            position(series.pairs.truth[i]) +
            fmt::format(",{:.9f},{:.9f}", series.absolute.trans_m[i], series.absolute.rot_deg[i]) +
            frames.next(i) + seconds.next(i) + "\n";
  }
  return text;
}

std::string errors_csv(const ErrorSeries& series) {
  return std::string(kErrorColumns) + "\n" + error_rows(series);
}

}  // namespace ygslam
