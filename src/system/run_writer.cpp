#include "system/run_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <numbers>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "geometry/smooth_path.hpp"
#include "io/atomic_file.hpp"
#include "io/ply.hpp"
#include "io/text.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {
namespace {

/// With three decimals.
void append_number(std::string& text, double value) {
  if (!std::isfinite(value)) {
    text += value > 0 ? "inf" : value < 0 ? "-inf" : "nan";
    return;
  }
  constexpr double kMost = 9e18;  // that a long long holds
  const long long thousandths = std::llround(std::min(std::abs(value) * 1000, kMost));
  if (value < 0 && thousandths > 0) text += '-';
  text += fmt::format("{}.{:03}", thousandths / 1000, thousandths % 1000);
}

constexpr std::size_t kWriteBytes = 1 << 16;

constexpr const char* kFramesHeader =
    "stamp,frame,state,matches,inliers,static_points,dynamic_points,unknown_points,few_static,"
    "mask_age_frames,provisional,correction_m,track_ms,track_cpu_ms,orb_ms,motion_ms,pose_ms,"
    "mask_ms,position_std_mm,rotation_std_deg,odom_drift_mm,odom_drift_deg,map_drift_mm,"
    "map_drift_deg\n";
constexpr const char* kObjectsHeader =
    "stamp,frame,id,class,age_frames,missing_frames,resting,points,x_m,y_m,z_m,vx_mps,vy_mps,"
    "vz_mps,min_x_m,min_y_m,min_z_m,max_x_m,max_y_m,max_z_m,faded,"
    "body_x_m,body_y_m,body_z_m,"
    "body_xx_cm2,body_xy_cm2,body_xz_cm2,body_yy_cm2,body_yz_cm2,body_zz_cm2,"
    "soon_x_m,soon_y_m,soon_z_m,"
    "soon_xx_cm2,soon_xy_cm2,soon_xz_cm2,soon_yy_cm2,soon_yz_cm2,soon_zz_cm2\n";

std::string frame_line(const FrameRecord& r, int stamp_decimals, bool with_times) {
  std::string text = format_stamp(r.stamp, stamp_decimals);
  text += ',' + std::to_string(index(r.frame)) + ',' + to_string(r.state);
  for (const int value :
       {r.matches, r.inliers, r.static_points, r.dynamic_points, r.unknown_points,
        static_cast<int>(r.few_static), r.mask_age_frames, static_cast<int>(r.provisional)}) {
    text += ',' + std::to_string(value);
  }
  text += ',';
  append_number(text, r.correction_m);
  for (const double ms :
       {r.track_ms, r.track_cpu_ms, r.orb_ms, r.motion_ms, r.pose_ms, r.mask_ms}) {
    text += ',';
    if (with_times) append_number(text, ms);
  }
  constexpr double kMostKnown_m = 100, kMillimetres = 1e3, kDegrees = 180 / std::numbers::pi;
  const bool is_known = r.position_std_m < kMostKnown_m;
  for (const double std : {kMillimetres * r.position_std_m, kDegrees * r.rotation_std_rad}) {
    text += ',';
    if (is_known) append_number(text, std);
  }
  for (const Doubt& drift : {r.odom_drift, r.map_drift}) {
    text += ',';
    if (is_known) append_number(text, kMillimetres * std::sqrt(3 * drift.position_m2));
    text += ',';
    if (is_known) append_number(text, kDegrees * std::sqrt(3 * drift.rotation_rad2));
  }
  return text + '\n';
}

/// A pose as in any trajectory, and the upper triangle of its covariance row by row.
std::string covariance_line(const StampedPose& pose, const Mat6& covariance, int stamp_decimals) {
  std::string text = format_tum(pose, stamp_decimals);
  text.pop_back();
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column)
      text += fmt::format(" {:.6g}", covariance(row, column));
  return text + '\n';
}

constexpr const char* kCovarianceHeader =
    "# timestamp tx ty tz qx qy qz qw, covariance xx xy xz xa xb xc yy ... cc [m, rad] "
    "(a, b, c: rotations about x, y, z)\n";

std::string missed_line(const OfferedFrame& missed, int stamp_decimals) {
  constexpr const char* kNothingMeasured = ",0,0,0,0,0,0,-1,0,0.000,,,,,,,,,,,,\n";
  return format_stamp(missed.stamp, stamp_decimals) + ',' + std::to_string(index(missed.id)) +
         (missed.is_dropped ? ",dropped" : ",unreadable") + kNothingMeasured;
}

constexpr double kSoon_s = 1;
constexpr double kCm2 = 1e4;  // in a square metre

/// Position and its covariance, the upper triangle.
void append_body(std::string& text, const ObjectMotion& body) {
  for (int axis = 0; axis < 3; ++axis) text += ',', append_number(text, body.position_m[axis]);
  for (int row = 0; row < 3; ++row)
    for (int column = row; column < 3; ++column)
      text += ',', append_number(text, kCm2 * body.covariance(row, column));
}

std::string object_lines(const FrameRecord& record, int stamp_decimals) {
  std::string text;
  for (const TrackedObject& o : record.objects) {
    text += format_stamp(record.stamp, stamp_decimals) + ',' + std::to_string(index(record.frame)) +
            ',' + std::to_string(index(o.id)) + ',' + coco_class_name(o.class_id);
    for (const int value : {o.age_frames, o.missing_frames, static_cast<int>(o.resting), o.points})
      text += ',' + std::to_string(value);
    for (const Vec3* vector : {&o.centre_world, &o.velocity_world_mps, &o.min_world, &o.max_world})
      for (int axis = 0; axis < 3; ++axis) text += ',', append_number(text, (*vector)[axis]);
    text += o.faded ? ",1" : ",0";
    append_body(text, o.body_world);
    append_body(text, o.body_world.after(kSoon_s));
    text += '\n';
  }
  return text;
}

void smooth(std::vector<StampedPose>& poses) {
  std::vector<PathPoint> path;
  for (const StampedPose& pose : poses)
    path.push_back({seconds_between(pose.stamp, poses.front().stamp), pose.T_world_camera.t()});
  const std::vector<Vec3> smoothed = smooth_path(path);
  for (std::size_t i = 0; i < poses.size(); ++i)
    poses[i].T_world_camera = SE3(poses[i].T_world_camera.R(), smoothed[i]);
}

/// Where the frames that they were made of lie in the trajectory.
std::vector<StampedPose> in_trajectory(std::vector<StampedPose> keyframes,
                                       std::span<const StampedPose> trajectory) {
  for (StampedPose& keyframe : keyframes) {
    const auto frame =
        std::ranges::lower_bound(trajectory, keyframe.stamp, {}, &StampedPose::stamp);
    if (frame != trajectory.end() && frame->stamp == keyframe.stamp)
      keyframe.T_world_camera = frame->T_world_camera;
  }
  return keyframes;
}

}  // namespace

std::vector<StampedPose> final_trajectory(const Trajectory& trajectory, const RevisedPoses& revised,
                                          const Map& map) {
  std::vector<StampedPose> poses;
  if (map.keyframes().empty()) return poses;
  const KeyframeId root = map.main_root();
  const auto roots = map.roots();
  const auto is_in_root = [&](const PosedFrame& frame) {
    return roots.at(map.nearest_kept(frame.reference)) == root;
  };
  const std::vector<SE3> T_world_camera = corrected_poses(trajectory, revised, map);
  std::vector<TurningPose> path;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    TurningPose turning = trajectory[i].turning(T_world_camera[i]);
    if (i > 0 && !is_in_root(trajectory[i - 1])) turning.turn_std_rad = 0;
    if (!is_in_root(trajectory[i])) continue;
    poses.push_back({trajectory[i].stamp, T_world_camera[i]});
    path.push_back(turning);
  }
  const std::vector<SE3> turned = smooth_turns(path);
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].T_world_camera = turned[i];
  smooth(poses);
  return poses;
}

std::vector<StampedPose> keyframe_trajectory(const Map& map) {
  std::vector<StampedPose> poses;
  const KeyframeId main_root = map.main_root();
  for (const auto& [id, root] : map.roots()) {
    const Keyframe& keyframe = map.keyframe(id);
    if (root == main_root)
      poses.push_back({keyframe.data->stamp, keyframe.T_camera_world.inverse()});
  }
  return poses;
}

Result<FrameFiles> FrameFiles::create(const std::filesystem::path& directory, int stamp_decimals,
                                      bool with_times, bool with_covariance) {
  FrameFiles files(directory, stamp_decimals, with_times, with_covariance);
  for (Growing* growing : {&files.frames_, &files.objects_, &files.live_, &files.odometry_,
                           &files.poses_, &files.retracked_})
    if (Status opened = files.open(*growing); !opened.ok()) return opened.error();
  return files;
}

FrameFiles::FrameFiles(std::filesystem::path directory, int stamp_decimals, bool with_times,
                       bool with_covariance)
    : directory_(std::move(directory)),
      frames_{"frames.csv", kFramesHeader},
      objects_{"objects.csv", kObjectsHeader},
      live_{"trajectory_live.txt", with_covariance ? kCovarianceHeader : ""},
      odometry_{"odometry.txt", kCovarianceHeader},
      poses_{"trajectory.txt", ""},
      retracked_{"trajectory.txt", ""},
      stamp_decimals_(stamp_decimals),
      with_times_(with_times),
      with_covariance_(with_covariance) {}

Status FrameFiles::open(Growing& growing) const {
  std::string name = (directory_ / ("." + growing.name + ".XXXXXX")).string();
  const int descriptor = ::mkostemp(name.data(), O_CLOEXEC);
  if (descriptor >= 0) ::unlink(name.c_str());
  growing.file.reset(descriptor >= 0 ? ::fdopen(descriptor, "w+b") : nullptr);
  if (growing.file) return Ok{};
  return Error{ErrorKind::kOutput,
               (directory_ / growing.name).string() + ": " + std::strerror(errno)};
}

Status FrameFiles::flush(Growing& growing) const {
  const std::string text = std::exchange(growing.waiting, "");
  if (std::fwrite(text.data(), 1, text.size(), growing.file.get()) == text.size() &&
      std::fflush(growing.file.get()) == 0)
    return Ok{};
  return Error{ErrorKind::kOutput,
               (directory_ / growing.name).string() + ": " + std::strerror(errno)};
}

Status FrameFiles::copy(Growing& growing) const {
  auto target = AtomicFile::create(directory_ / growing.name);
  if (!target.ok()) return target.error();
  std::rewind(growing.file.get());
  std::vector<char> block(kWriteBytes);
  while (const std::size_t n = std::fread(block.data(), 1, block.size(), growing.file.get()))
    if (Status written = target->write({block.data(), n}); !written.ok()) return written;
  return target->commit();
}

template <typename Entry>
void FrameFiles::put_bytes(Growing& growing, const Entry& entry) {
  static_assert(std::is_trivially_copyable_v<Entry>);
  put(growing, {reinterpret_cast<const char*>(&entry), sizeof entry});
}

void FrameFiles::add(const FrameRecord& record, std::span<const RetrackedFrame> retracked) {
  for (const RetrackedFrame& frame : retracked) put_bytes(retracked_, RetrackedPose(frame));
  put(frames_, frame_line(record, stamp_decimals_, with_times_));
  put(objects_, object_lines(record, stamp_decimals_));
  if (!record.has_pose()) return;
  const StampedPose live{record.stamp, record.T_world_camera_live};
  if (with_covariance_) {
    const bool is_whole =
        record.T_world_camera_live.is_finite() && record.T_odom_camera.is_finite();
    if (is_whole) {
      put(live_, covariance_line(live, record.map_covariance, stamp_decimals_));
      put(odometry_, covariance_line({record.stamp, record.T_odom_camera}, record.odom_covariance,
                                     stamp_decimals_));
    }
  } else {
    put(live_, format_tum(std::span(&live, 1), stamp_decimals_));
  }
  put_bytes(poses_, PosedFrame(record));
}

void FrameFiles::add_missed(const OfferedFrame& missed) {
  put(frames_, missed_line(missed, stamp_decimals_));
}

template <typename Entry, typename Take>
Status FrameFiles::read(Growing& growing, Take take) {
  if (state_.ok()) state_ = flush(growing);
  if (!state_.ok()) return state_;
  std::rewind(growing.file.get());
  for (Entry entry; std::fread(&entry, sizeof entry, 1, growing.file.get()) == 1;) take(entry);
  if (std::ferror(growing.file.get()) == 0) return Ok{};
  return Error{ErrorKind::kOutput,
               (directory_ / growing.name).string() + ": " + std::strerror(errno)};
}

Result<Trajectory> FrameFiles::trajectory() {
  Trajectory trajectory;
  const Status status =
      read<PosedFrame>(poses_, [&](const PosedFrame& posed) { trajectory.push_back(posed); });
  if (!status.ok()) return status.error();
  return trajectory;
}

Result<RevisedPoses> FrameFiles::revised(const Map& map, RevisedPoses others) {
  const Status status =
      read<RetrackedPose>(retracked_, [&](const RetrackedPose& pose) { pose.revise(map, others); });
  if (!status.ok()) return status.error();
  return others;
}

void FrameFiles::put(Growing& growing, std::string_view text) {
  growing.waiting += text;
  if (growing.waiting.size() >= kWriteBytes && state_.ok()) state_ = flush(growing);
}

Status FrameFiles::commit() {
  for (Growing* growing : {&frames_, &objects_, &live_, &odometry_}) {
    if (growing == &odometry_ && !with_covariance_) {
      std::error_code code;  // of an earlier run
      std::filesystem::remove(directory_ / growing->name, code);
      continue;
    }
    if (state_.ok()) state_ = flush(*growing);
    if (state_.ok()) state_ = copy(*growing);
  }
  return state_;
}

std::string loops_csv(std::span<const LoopAttempt> attempts, int stamp_decimals) {
  std::string text =
      "stamp,keyframe,place,place_stamp,outcome,verdict,score,matches,guided,inliers,contradiction,"
      "path_m,correction_m,correction_rad,agreeing,stretch\n";
  for (const LoopAttempt& attempt : attempts) {
    const PlaceMatch& match = attempt.match;
    text += format_stamp(attempt.stamp, stamp_decimals) + ',' +
            std::to_string(index(attempt.keyframe)) + ',' + std::to_string(index(match.place)) +
            ',' + format_stamp(attempt.place_stamp, stamp_decimals) + ',' +
            to_string(attempt.outcome) + ',' + to_string(match.verdict) + ',';
    append_number(text, attempt.score);
    for (const int count : {match.matches, match.guided, match.inliers})
      text += ',' + std::to_string(count);
    for (const double value :
         {match.contradiction, attempt.path_m, attempt.correction_m, attempt.correction_rad,
          static_cast<double>(attempt.agreeing), attempt.stretch}) {
      text += ',';
      append_number(text, value);
    }
    text += '\n';
  }
  return text;
}

Status write_run(const std::filesystem::path& directory, std::span<const StampedPose> trajectory,
                 const Map& map, std::span<const ColouredPoint> cloud, int stamp_decimals) {
  const std::pair<const char*, std::string> texts[] = {
      {"trajectory.txt", format_tum(trajectory, stamp_decimals)},
      {"keyframes.txt",
       format_tum(in_trajectory(keyframe_trajectory(map), trajectory), stamp_decimals)}};
  for (const auto& [name, text] : texts) {
    Status written = write_file_atomically(directory / name, text);
    if (!written.ok()) return written;
  }
  return write_ply(directory / "map.ply", cloud);
}

}  // namespace ygslam
