#include "system/run_writer.hpp"

#include <cmath>
#include <cstdio>

#include "io/atomic_file.hpp"
#include "io/ply.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {
namespace {

std::string stamp_text(Timestamp stamp, int decimals) {
  // format_tum() knows how stamps are written; its line starts with one.
  const std::string line = format_tum(StampedPose{stamp, SE3()}, decimals);
  return line.substr(0, line.find(' '));
}

void append_number(std::string& text, double value, int decimals) {
  // Through to_chars-like integers: snprintf would follow the locale's decimal point.
  const auto scale = decimals == 3 ? 1000.0 : 1.0;
  const auto fixed = static_cast<long long>(std::abs(value) * scale + 0.5);
  if (value < 0 && fixed > 0) text += '-';
  text += std::to_string(fixed / static_cast<long long>(scale));
  if (decimals == 3) {
    char fraction[8];
    std::snprintf(fraction, sizeof fraction, ".%03lld", fixed % 1000);
    text += fraction;
  }
}

}  // namespace

std::vector<StampedPose> final_trajectory(const SlamOutcome& outcome, const Map& map) {
  std::vector<StampedPose> poses;
  for (const FrameRecord& record : outcome.frames) {
    if (record.has_pose()) poses.push_back({record.stamp, corrected_pose(record, map)});
  }
  return poses;
}

std::vector<StampedPose> live_trajectory(const SlamOutcome& outcome) {
  std::vector<StampedPose> poses;
  for (const FrameRecord& record : outcome.frames) {
    if (record.has_pose()) poses.push_back({record.stamp, record.T_world_camera_live});
  }
  return poses;
}

std::vector<StampedPose> keyframe_trajectory(const Map& map) {
  std::vector<StampedPose> poses;
  for (const auto& [id, keyframe] : map.keyframes()) {
    poses.push_back({keyframe.data->stamp, keyframe.T_camera_world.inverse()});
  }
  return poses;
}

std::string frames_csv(const SlamOutcome& outcome, int stamp_decimals, bool with_times) {
  std::string text =
      "stamp,frame,state,matches,inliers,static_points,dynamic_points,unknown_points,few_static,"
      "mask_age_frames,track_ms,track_cpu_ms,orb_ms,motion_ms,pose_ms\n";
  for (const FrameRecord& r : outcome.frames) {
    text += stamp_text(r.stamp, stamp_decimals);
    text += ',' + std::to_string(index(r.frame)) + ',' + to_string(r.state);
    for (const int value : {r.matches, r.inliers, r.static_points, r.dynamic_points,
                            r.unknown_points, static_cast<int>(r.few_static), r.mask_age_frames}) {
      text += ',' + std::to_string(value);
    }
    for (const double ms : {r.track_ms, r.track_cpu_ms, r.orb_ms, r.motion_ms, r.pose_ms}) {
      text += ',';
      if (with_times) append_number(text, ms, 3);
    }
    text += '\n';
  }
  return text;
}

std::string objects_csv(const SlamOutcome& outcome, int stamp_decimals) {
  std::string text =
      "stamp,frame,id,class,age_frames,missing_frames,resting,points,x_m,y_m,z_m,vx_mps,vy_mps,"
      "vz_mps,min_x_m,min_y_m,min_z_m,max_x_m,max_y_m,max_z_m\n";
  for (const FrameRecord& record : outcome.frames) {
    for (const TrackedObject& o : record.objects) {
      text += stamp_text(record.stamp, stamp_decimals) + ',' + std::to_string(index(record.frame)) +
              ',' + std::to_string(index(o.id)) + ',' + coco_class_name(o.class_id);
      for (const int value :
           {o.age_frames, o.missing_frames, static_cast<int>(o.resting), o.points})
        text += ',' + std::to_string(value);
      for (const Vec3* vector :
           {&o.centre_world, &o.velocity_world_mps, &o.min_world, &o.max_world})
        for (int axis = 0; axis < 3; ++axis) text += ',', append_number(text, (*vector)[axis], 3);
      text += '\n';
    }
  }
  return text;
}

Status write_run(const std::filesystem::path& directory, const SlamOutcome& outcome,
                 const MappingStage& mapping, int stamp_decimals, bool with_times) {
  const Map& map = mapping.map();
  const std::pair<const char*, std::string> texts[] = {
      {"trajectory.txt", format_tum(final_trajectory(outcome, map), stamp_decimals)},
      {"trajectory_live.txt", format_tum(live_trajectory(outcome), stamp_decimals)},
      {"keyframes.txt", format_tum(keyframe_trajectory(map), stamp_decimals)},
      {"frames.csv", frames_csv(outcome, stamp_decimals, with_times)},
      {"objects.csv", objects_csv(outcome, stamp_decimals)}};
  for (const auto& [name, text] : texts) {
    Status written = write_file_atomically(directory / name, text);
    if (!written.ok()) return written;
  }
  return write_ply(directory / "map.ply", mapping.cloud());
}

}  // namespace ygslam
