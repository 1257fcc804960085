#include "system/slam_config.hpp"

#include "segment/movable.hpp"
#include "system/parts.hpp"

namespace ygslam {
namespace {

void add_run_keys(ConfigSchema& s, RunConfig& c) {
  s.number("run.seed", c.seed, std::uint64_t{0}, std::uint64_t{1} << 53, "",
           "start of every random sequence", "to see how far chance moves a result");
  s.number("run.mask_delay_frames", c.mask_delay_frames, 0, 30, "frames",
           "--deterministic delivers masks this late",
           "to play a slower or a faster network with the same result every time");
  s.number("run.max_lost_share", c.max_lost_share, 0.0, 1.0, "",
           "no pose in a larger share of the frames (lost, unreadable, dropped): exit code 7",
           "when a script should notice losses earlier or put up with more");
  s.number("run.first_mask_timeout_s", c.first_mask_timeout_s, 0.0, 60.0, "s",
           "live: how long the very first frame waits for its mask, 0 = not at all",
           "longer for a slow processor and people in view at the start; 0 for a robot that must "
           "start at once");
  s.number("run.file_mask_lag_frames", c.file_mask_lag_frames, 0, 1000, "frames",
           "live, frames out of a file: wait for masks older than this, 0 = never (as --realtime)",
           "smaller for fresher masks, larger to be through with a file sooner");
  s.number("run.finish_patience_s", c.finish_patience_s, 0.0, 3600.0, "s",
           "live: how long the end of a run waits for masks of its last keyframes",
           "longer with a slow network, so that the last keyframes reach map.ply");
  s.words("run.without", c.without, "parts that are left out: " + part_names(),
          "to see what a part is worth on your own sequence");
}

void add_input_keys(ConfigSchema& s, SlamConfig& c) {
  s.number("depth.min_m", c.depth.min_m, 0.0, 100.0, "m", "nearer depth is taken as none",
           "for a camera that measures nearer than a Kinect, or not as near");
  s.number("depth.max_m", c.depth.max_m, 0.1, 100.0, "m", "farther depth is taken as none",
           "for a camera with a longer range, or outdoors");
  s.number("orb.features", c.orb.features, 50, 10000, "", "features per frame",
           "fewer on a weak processor, more for images larger than 640x480");
  s.number("orb.levels", c.orb.levels, 1, 12, "", "pyramid levels, each 1.2 times smaller",
           "fewer for small images, more for large ones");
  s.number("orb.fast_threshold", c.orb.fast_threshold, 1, 254, "grey levels",
           "FAST threshold; a third of it where a cell has no corner",
           "lower for dark or washed-out images, higher for noisy ones");
}

void add_motion_keys(ConfigSchema& s, SlamConfig& config) {
  DynamicConfig& c = config.dynamic;
  std::vector<std::pair<std::string, DynamicMode>> modes;
  for (const DynamicMode mode :
       {DynamicMode::kOff, DynamicMode::kGeometry, DynamicMode::kSemantic, DynamicMode::kFull})
    modes.emplace_back(mode_name(mode), mode);
  s.choice("dynamic.mode", c.mode, modes, "what is done about moving things (--dynamic)",
           "off where nothing moves, geometry where no network can run");
  s.number("motion.tau_px", c.epipolar.tau_px, 0.01, 50.0, "px",
           "farther from its epipolar line a point is dynamic (Algorithm 1)",
           "with the size and sharpness of the images: larger for blurred or large ones");
  s.number("motion.reprojection_px", c.ego_motion.limit_px, 0.1, 50.0, "px",
           "farther from where it would be seen if it stood still a point is dynamic",
           "larger where depth and colour fit together worse than a Kinect's");
  s.number("labels.min_static", c.classifier.min_static, 0, 1000, "points",
           "with fewer usable points the least dynamic ones come back",
           "lower where movers fill the view for long and drifting with them would be worse than "
           "being lost");
  s.number("labels.unknown_weight", c.classifier.unknown_weight, 0.0, 1.0, "",
           "weight of a point nothing is known about",
           "towards 1 in rooms where little moves, towards 0 in crowds");
  s.number("masks.outer_band_px", c.masks.mask.outer_band_px, 0.0, 20.0, "px",
           "outside, this near to a mask's edge: on the object where the depth says so",
           "larger for a network whose masks are tighter than YOLOv8n's");
  s.number("masks.inner_band_px", c.masks.mask.inner_band_px, 0.0, 20.0, "px",
           "inside, this near to a mask's edge: background where the depth says so",
           "larger for a network whose masks are wider than YOLOv8n's");
  s.number("objects.keep_s", config.tracking.objects.keep_s, 0.0, 3600.0, "s",
           "a person out of sight for no longer gets the same number again",
           "longer where the same people come and go, shorter in passing crowds");
}

void add_segment_keys(ConfigSchema& s, SegmentConfig& c) {
  s.choice("segment.precision", c.network.precision,
           {{"auto", Precision::kAuto},
            {"f32", Precision::kF32},
            {"bf16", Precision::kBf16},
            {"int8", Precision::kInt8}},
           "of the network; auto = the fastest the processor has for the given model",
           "to reproduce the result of another machine");
  s.number("segment.threads", c.network.threads, 1, 64, "", "threads that run the network",
           "more on a processor with more than two cores");
  s.number("segment.input_width", c.network.input_width, 32, 2048, "px",
           "for models with open input size, a multiple of 32",
           "smaller for speed, larger to find people far away");
  s.number("segment.input_height", c.network.input_height, 32, 2048, "px",
           "for models with open input size, a multiple of 32",
           "with the width, in the shape of the camera's images");
  s.number("segment.score_threshold", c.network.decode.score_threshold, 0.01, 1.0, "",
           "detections below are ignored",
           "lower for a network that misses people, higher for one that sees ghosts");
  s.number("segment.others_threshold", c.network.decode.others_threshold, 0.01, 1.0, "",
           "the same of classes that cannot move: things of the dense map",
           "lower to find more of them, higher for fewer that are none");
  s.words("segment.movable", c.movable,
          "classes that can move, beside persons and animals: COCO names, or vehicles, handheld, "
          "furniture",
          "where cars or pushed chairs are about");
}

void add_tracking_keys(ConfigSchema& s, TrackerConfig& c) {
  s.number("tracking.min_inliers", c.judge.min_inliers, 6, 1000, "points",
           "fewer: weak; half: lost",
           "lower in bare rooms with few features, higher where a wrong pose is costly");
  s.number("tracking.weak_position_std_m", c.judge.weak_position_std_m, 0.001, 10.0, "m",
           "a camera centre less certain than this: weak",
           "with how certain a robot needs to be of its place");
  s.number("tracking.lost_position_std_m", c.judge.lost_position_std_m, 0.001, 10.0, "m",
           "a camera centre less certain than this: lost",
           "with how uncertain a place may be before it is better called none");
  s.number("tracking.max_jump_mps", c.judge.max_jump_mps, 0.0, 100.0, "m/s",
           "a weak pose that is farther from the predicted one than this speed explains is not "
           "believed",
           "higher for a camera on something fast");
  s.number("tracking.search_last_px", c.pose.search_last_px, 1.0, 200.0, "px",
           "window around the predicted pose, at pyramid level 0",
           "larger for jerky motion, low frame rates and large images");
  s.number("keyframe.max_interval_frames", c.keyframe.max_interval_frames, 2, 10000, "frames",
           "a moving camera makes a keyframe at least this often",
           "smaller for a denser map, with the frame rate of the camera");
  s.number("keyframe.tracked_ratio", c.keyframe.tracked_ratio, 0.0, 1.0, "",
           "share of the reference keyframe's landmarks below which a keyframe is made",
           "higher for a denser map, lower for a smaller one");
  s.number("keyframe.close_depth_m", c.keyframe.close_depth_m, 0.1, 100.0, "m",
           "depth is trusted up to here when it is asked whether a keyframe is due",
           "for a depth camera that is good farther than a Kinect, or not as far");
}

void add_mapping_keys(ConfigSchema& s, SlamConfig& c) {
  s.number("mapping.free_keyframes", c.mapping.window.free_keyframes, 2, 60, "",
           "keyframes a local bundle adjustment moves",
           "fewer on a weak processor, more for accuracy");
  s.number("mapping.view_landmarks", c.mapping.view.landmarks, 100, 100000, "",
           "landmarks that tracking matches against",
           "fewer for speed, more for accuracy with large images");
  s.number("noise.sigma_px", c.mapping.noise.sigma_px, 0.05, 10.0, "px",
           "localisation noise of a corner at pyramid level 0",
           "for a sharper or a more blurred camera");
  s.number("noise.depth_sigma_scale", c.mapping.noise.depth_sigma_scale, 0.1, 100.0, "",
           "noise of a corner's depth in units of the Kinect's, where it lies on no plane",
           "less for a depth camera that is one with the colour camera");
  s.number("dense.voxel_m", c.dense.volume.surface.voxel_m, 0.005, 1.0, "m",
           "side of a voxel of the dense map", "smaller for detail, larger for large rooms");
  s.number("dense.max_depth_m", c.dense.volume.preparation.max_depth_m, 0.1, 6.5, "m",
           "farther depth makes no surface", "nearer for a cleaner map, farther for a fuller one");
  s.number("dense.min_views", c.dense.reading.min_views, 1, 100, "",
           "keyframes that must have seen a surface",
           "higher against single wrong measurements, 1 for short recordings");
  s.number(
      "dense.plan_low_m", c.dense.plan.low_m, 0.0, 10.0, "m",
      "plan() of the library and the ROS node: what is lower above the floor can be driven over",
      "to what your robot climbs");
  s.number("dense.plan_high_m", c.dense.plan.high_m, 0.05, 10.0, "m",
           "what is higher can be driven under", "to the height of your robot");
  s.number("dense.interval_s", c.dense.interval_s, 0.0, 3600.0, "s",
           "without a keyframe for so long, the dense map looks at a frame between them",
           "0 for keyframes alone, longer on a weak processor");
}

}  // namespace

ConfigSchema schema_of(SlamConfig& config) {
  ConfigSchema schema;
  add_run_keys(schema, config.run);
  add_input_keys(schema, config);
  add_motion_keys(schema, config);
  add_segment_keys(schema, config.segment);
  add_tracking_keys(schema, config.tracking);
  add_mapping_keys(schema, config);
  return schema;
}

Result<SlamConfig> resolved(SlamConfig config) {
  const auto movable = MovableClasses::of_names(config.segment.movable);
  if (!movable.ok()) return movable.error();
  config.dynamic.masks.mask.movable = *movable;
  config.tracking.objects.movable = *movable;
  config.tracking.free_space.enabled = uses_geometry(config.dynamic.mode);
  config.dynamic.boundary.pyramid_scale = config.orb.scale_factor;
  for (const std::string& part : config.run.without)
    if (const Status status = leave_out(part, config); !status.ok()) return status.error();
  config.tracking.pose.noise = config.mapping.noise;
  config.loop.finder.verifier.noise.edge_weight = config.mapping.noise.edge_weight;
  return config;
}

}  // namespace ygslam
