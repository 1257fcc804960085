#include "system/early_frames.hpp"

#include <algorithm>
#include <iterator>

#include "features/attach.hpp"
#include "map/observation_noise.hpp"
#include "optim/pose_only.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMostFrames = 1500;  // 50 s: who has not moved by then has nothing to correct
constexpr std::size_t kMaxMatches = 150;
constexpr std::size_t kMinMatches = 20;
constexpr double kNearest_m = 0.3;    // nearer, a landmark's own error is many pixels
constexpr double kNeighbour_s = 0.1;  // two frames tell the velocity between them
constexpr int kRounds = 2;            // the first with the velocities tracking had

}  // namespace

void EarlyFrames::add(const FrameRecord& record, const TrackResult& result) {
  if (record.has_pose() && result.guessed_read_out) keep(record, result);
  if (!result.shutter || !result.shutter->taken_over) return;
  times_ = result.shutter->times;
  std::ranges::move(waiting_, std::back_inserter(early_));
  waiting_.clear();
}

void EarlyFrames::keep(const FrameRecord& record, const TrackResult& result) {
  Frame frame{record.frame, record.stamp, record.pose, *result.guessed_read_out, {}};
  const auto matched = static_cast<std::size_t>(std::ssize(result.landmarks) -
                                                std::ranges::count(result.landmarks, kNoLandmark));
  const std::size_t stride = matched / kMaxMatches + 1;
  std::size_t found = 0;
  for (std::size_t i = 0; i < result.landmarks.size(); ++i) {
    if (result.landmarks[i] == kNoLandmark || found++ % stride != 0) continue;
    const Feature& f = result.features->points[i];
    frame.matches.push_back({result.landmarks[i], f.ideal_px, f.uv_px.y(), f.depth_m,
                             result.labels.weight[i], f.octave, f.on_depth_edge, f.on_plane});
  }
  waiting_.push_back(std::move(frame));
  if (waiting_.size() > kMostFrames) waiting_.pop_front();
}

class EarlyFrames::Revision {
 public:
  Revision(const std::vector<Frame>& frames, const ShutterTimes& times, const Map& map,
           const Camera& camera)
      : frames_(frames), map_(map), camera_(camera) {
    for (const Frame& frame : frames) {
      ReadOut read_out{times, frame.read_out.body_velocity};
      const KeyframeRelativePose& pose = frame.pose;
      placed_.push_back(
          {read_out, pose_in(map, frame.frame, pose.reference, pose.T_camera_reference), false});
    }
    for (int round = 0; round < kRounds; ++round) {
      if (round > 0) measure_velocities();
      for (std::size_t i = 0; i < frames_.size(); ++i) place(frames_[i], placed_[i]);
    }
  }

  [[nodiscard]] RevisedPoses poses() const {
    RevisedPoses poses;
    for (std::size_t i = 0; i < frames_.size(); ++i)
      // Of a keyframe the map knows better.
      if (placed_[i].found && map_.keyframe_of(frames_[i].frame) == kNoKeyframe)
        poses.emplace(frames_[i].frame, placed_[i].T_camera_world);
    return poses;
  }

 private:
  struct Placed {
    ReadOut read_out;
    SE3 T_camera_world;
    bool found;
  };

  void measure_velocities() {
    for (std::size_t i = 1; i + 1 < frames_.size(); ++i) {
      const double dt_s = seconds_between(frames_[i + 1].stamp, frames_[i - 1].stamp);
      if (dt_s <= 0 || dt_s > kNeighbour_s || !placed_[i - 1].found || !placed_[i + 1].found)
        continue;
      const SE3 T_before_after =
          placed_[i - 1].T_camera_world * placed_[i + 1].T_camera_world.inverse();
      placed_[i].read_out.body_velocity = T_before_after.log() / dt_s;
    }
  }

  void place(const Frame& frame, Placed& placed) const {
    Features features;
    std::vector<const Match*> matches;
    for (const Match& match : frame.matches) {
      if (!map_.has_landmark(match.landmark)) continue;
      const Vec3 p_cam = placed.T_camera_world * map_.landmark(match.landmark).p_world;
      if (p_cam.z() < kNearest_m) continue;
      Feature f;
      f.uv_px = {0, match.row_px};
      f.ideal_px = match.ideal_px;
      f.depth_m = match.depth_m;
      f.octave = match.octave;
      f.on_depth_edge = match.on_depth_edge;
      f.on_plane = match.on_plane;
      features.points.push_back(f);
      matches.push_back(&match);
    }
    if (matches.size() < kMinMatches) return;
    move_to_other_times(features, camera_, frame.read_out, placed.read_out);
    std::vector<PoseObservation> observations;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const Feature& f = features.points[i];
      observations.push_back(
          {map_.landmark(matches[i]->landmark).p_world,
           observation_of(f, map_.scales().of(f.octave), NoiseConfig{}, matches[i]->weight)});
    }
    const auto pose = solve_pose(camera_, placed.T_camera_world, observations, PoseOnlyConfig{});
    if (!pose || pose->inliers < static_cast<int>(kMinMatches)) return;
    placed.T_camera_world = pose->T_camera_world;
    placed.found = true;
  }

  const std::vector<Frame>& frames_;
  const Map& map_;
  const Camera& camera_;
  std::vector<Placed> placed_;
};

RevisedPoses EarlyFrames::revised(const Map& map, const Camera& camera) const {
  return times_ ? Revision(early_, *times_, map, camera).poses() : RevisedPoses{};
}

}  // namespace ygslam
