#include "system/slam_config.hpp"

namespace ygslam {
namespace {

void add_input_keys(ConfigSchema& s, SlamConfig& c) {
  s.number("run.seed", c.run.seed, std::uint64_t{0}, std::uint64_t{1} << 53, "",
           "start of every random sequence");
  s.number("run.mask_delay_frames", c.run.mask_delay_frames, 0, 30, "frames",
           "--deterministic delivers masks this late");
  s.number("run.max_lost_share", c.run.max_lost_share, 0.0, 1.0, "",
           "lost for a larger share of the readable frames: exit code 7");
  s.number("run.first_mask_timeout_s", c.run.first_mask_timeout_s, 0.0, 60.0, "s",
           "live: how long the very first frame waits for its mask, 0 = not at all");
  s.number("run.file_mask_lag_frames", c.run.file_mask_lag_frames, 0, 1000, "frames",
           "live, frames out of a file: wait for masks older than this, 0 = never (as --realtime)");
  s.number("run.finish_patience_s", c.run.finish_patience_s, 0.0, 3600.0, "s",
           "live: how long the end of a run waits for masks of its last keyframes");
  s.number("depth.min_m", c.depth.min_m, 0.0, 100.0, "m", "nearer depth is taken as none");
  s.number("depth.max_m", c.depth.max_m, 0.1, 100.0, "m", "farther depth is taken as none");
  s.number("orb.features", c.orb.features, 50, 10000, "", "features per frame");
  s.number("orb.levels", c.orb.levels, 1, 12, "", "pyramid levels");
  s.number("orb.scale_factor", c.orb.scale_factor, 1.05, 2.0, "", "between pyramid levels");
  s.number("orb.fast_threshold", c.orb.fast_threshold, 1, 254, "grey levels", "FAST threshold");
  s.number("orb.fast_threshold_low", c.orb.fast_threshold_low, 1, 254, "grey levels",
           "FAST threshold of cells without a corner, at most orb.fast_threshold");
}

void add_motion_keys(ConfigSchema& s, DynamicConfig& c) {
  s.choice("dynamic.mode", c.mode,
           {{"off", DynamicMode::kOff},
            {"geometry", DynamicMode::kGeometry},
            {"semantic", DynamicMode::kSemantic},
            {"full", DynamicMode::kFull}},
           "what is done about moving things (--dynamic)");
  s.flag("motion.prior", c.epipolar.prior,
         "fundamental matrix from points static in the previous frame only; false = all vote");
  s.choice("motion.corners", c.epipolar.corners,
           {{"orb", FlowCorners::kOrb}, {"harris", FlowCorners::kHarris}},
           "which corners the epipolar check follows");
  s.number("motion.tau_px", c.epipolar.tau_px, 0.01, 50.0, "px",
           "within this distance of its epipolar line a point obeys it (Algorithm 1, tau)");
  s.number("motion.limit_tau_px", c.epipolar.limit_tau_px, 0.01, 50.0, "px",
           "beyond this distance a point is dynamic (Algorithm 1, limit_tau)");
  s.number("motion.link_radius_px", c.epipolar.link_radius_px, 0.1, 20.0, "px",
           "a feature takes the label of the nearest flow end within");
  s.number("motion.min_static", c.epipolar.min_static, 8, 1000, "points", "fewer candidates: no verdict");
  s.flag(
      "rigid.enabled", c.ego_motion.enabled,
      "hold the flow against the camera's motion in three dimensions; false = epipolar line alone");
  s.number("rigid.limit_px", c.ego_motion.limit_px, 0.1, 50.0, "px",
           "farther from where a standing point would be: dynamic");
  s.number("rigid.limit_medians", c.ego_motion.limit_medians, 1.0, 100.0, "",
           "... and farther than this many medians of the standing points' residuals");
  s.flag("anchor.enabled", c.history.enabled,
         "hold points against where they were a dozen frames ago (finds slow movers); needs "
         "rigid.enabled, motion.corners orb");
  s.number("anchor.min_age_frames", c.history.min_age_frames, 1, 16, "frames",
           "a younger anchor says nothing");
  s.number("anchor.limit_px", c.history.limit_px, 0.1, 50.0, "px",
           "farther from where its anchor puts it: the point moves");
  s.number("anchor.limit_medians", c.history.limit_medians, 1.0, 100.0, "",
           "... and farther than this many medians of the standing points' residuals");
  s.number("anchor.spacing_frames", c.history.spacing_frames, 1, 30, "frames",
           "between the anchors of a point; four are kept");
    s.flag("labels.second_look", c.classifier.second_look,
         "judge every point again against the pose found from the map; needs rigid.enabled");
  s.flag("labels.rim", c.boundary.enabled,
         "corners where an outline crosses what is behind it are unknown, not dynamic");
  s.flag("labels.vote_of_neighbours", c.classifier.vote_of_neighbours,
         "features at which no flow ends are judged as the flows around them");
  s.number("labels.min_moving_share", c.classifier.min_moving_share, 0.0, 1.0, "",
           "of the points around it that must move for a point to be dynamic");
  s.number("propagation.missed_object_frames", c.masks.missed_object_frames, 0, 300, "frames",
           "an object that a mask overlooks is kept this long");
  s.number("masks.outer_band_px", c.masks.mask.outer_band_px, 0.0, 20.0, "px",
           "outside, this near to a mask's edge: on the object where the depth says so");
  s.number("masks.inner_band_px", c.masks.mask.inner_band_px, 0.0, 20.0, "px",
           "inside, this near to a mask's edge: background where the depth says so");
  s.number("masks.same_depth_ratio", c.masks.mask.same_depth_ratio, 0.0, 1.0, "",
           "just outside a mask and at the object's depth to this: on the object");
  s.number("masks.behind_ratio", c.masks.mask.behind_ratio, 0.01, 1.0, "",
           "inside a mask but farther than the object by this: background");
  s.number("flow.window_px", c.flow.window_px, 5, 51, "px", "side of the flow window, odd");
  s.number("flow.levels", c.flow.levels, 0, 6, "", "pyramid levels of the flow");
  s.number("flow.patch_diff", c.flow.patch_diff, 0.0, 255.0, "grey levels",
           "mean difference of the 3x3 patches above which a flow is dropped");
  s.number("flow.border_px", c.flow.border_px, 0.0, 100.0, "px",
           "flows that end nearer to the border are dropped");
  s.number("labels.unknown_weight", c.classifier.unknown_weight, 0.0, 1.0, "",
           "weight of a point nothing is known about");
  s.number("labels.min_static", c.classifier.min_static, 0, 1000, "points",
           "fewer static points: the least suspicious come back");
  s.number("labels.max_dynamic_share", c.classifier.max_dynamic_share, 0.0, 1.0, "",
           "an epipolar check that flags more than this is not believed");
}

void add_segment_keys(ConfigSchema& s, SegmentConfig& c) {
  s.choice("segment.precision", c.yolo.precision,
           {{"auto", Precision::kAuto},
            {"f32", Precision::kF32},
            {"bf16", Precision::kBf16},
            {"int8", Precision::kInt8}},
           "of the network; auto = the fastest the processor has for the given model");
  s.number("segment.threads", c.yolo.threads, 1, 64, "", "threads that run the network");
  s.number("segment.input_width", c.yolo.input_width, 32, 2048, "px",
           "for models with open input size, a multiple of 32");
  s.number("segment.input_height", c.yolo.input_height, 32, 2048, "px",
           "for models with open input size, a multiple of 32");
  s.number("segment.score_threshold", c.yolo.decode.score_threshold, 0.01, 1.0, "",
           "detections below are ignored");
  s.number("segment.nms_iou", c.yolo.decode.nms_iou, 0.0, 1.0, "",
           "of two boxes of a class that overlap more, one goes");
  s.words("segment.movable", c.movable,
          "classes that can move: COCO names, or animals, vehicles, handheld, furniture");
}

void add_tracking_keys(ConfigSchema& s, TrackerConfig& c) {
  s.number("tracking.min_start_points", c.min_start_points, 10, 10000, "points",
           "static features with depth that make the first frame");
  s.number("tracking.min_inliers", c.min_inliers, 6, 1000, "points", "fewer: weak");
  s.number("tracking.min_inliers_weak", c.min_inliers_weak, 6, 1000, "points", "fewer: lost");
  s.number("tracking.weak_frames_until_lost", c.weak_frames_until_lost, 1, 1000, "frames",
           "weak frames in a row that count as lost");
  s.number("tracking.weak_position_std_m", c.weak_position_std_m, 0.001, 10.0, "m",
           "a camera centre less certain than this: weak");
  s.number("tracking.lost_position_std_m", c.lost_position_std_m, 0.001, 10.0, "m",
           "a camera centre less certain than this: lost");
  s.number("tracking.max_jump_m", c.max_jump_m, 0.001, 10.0, "m",
           "a weak pose farther from the predicted one is not believed");
  s.number("tracking.max_jump_mps", c.max_jump_mps, 0.0, 100.0, "m/s",
           "... or, over a longer gap, farther than this speed would carry it");
  s.number("tracking.search_last_px", c.pose.search_last_px, 1.0, 200.0, "px",
           "window around the predicted pose, at pyramid level 0");
  s.number("tracking.search_map_px", c.pose.search_map_px, 1.0, 50.0, "px",
           "window around the first pose, at pyramid level 0");
  s.flag("tracking.weigh_landmarks", c.pose.weigh_landmarks,
         "a landmark weighs by how often it was found where it should be");
  s.flag("tracking.intruders", c.free_space.enabled,
         "points where keyframes saw empty space are dynamic, whether they move or not");
  s.flag("tracking.use_local_map", c.pose.use_local_map,
         "false: match the previous frame only (to see what the map is worth)");
  s.number("keyframe.min_interval_frames", c.keyframe.min_interval_frames, 1, 1000, "frames",
           "least distance of keyframes");
  s.number("keyframe.max_interval_frames", c.keyframe.max_interval_frames, 1, 10000, "frames",
           "a moving camera makes one at least this often");
  s.number("keyframe.tracked_ratio", c.keyframe.tracked_ratio, 0.0, 1.0, "",
           "share of the reference keyframe's landmarks below which a new one is made");
  s.number("keyframe.close_depth_m", c.keyframe.close_depth_m, 0.1, 100.0, "m",
           "depth is trusted up to here");
}

void add_mapping_keys(ConfigSchema& s, SlamConfig& c) {
  s.flag("mapping.local_bundle", c.mapping.local_bundle,
         "local bundle adjustment (false to see what it is worth)");
  s.number("mapping.free_keyframes", c.mapping.window.free_keyframes, 2, 60, "",
           "keyframes a local bundle adjustment moves");
  s.number("mapping.fixed_keyframes", c.mapping.window.fixed_keyframes, 0, 200, "",
           "keyframes that hold it in place");
  s.number("mapping.close_depth_m", c.mapping.landmarks.close_depth_m, 0.1, 100.0, "m",
           "every static feature nearer than this becomes a landmark");
  s.number("mapping.redundant_share", c.mapping.culling.redundant_share, 0.5, 1.0, "",
           "a keyframe whose landmarks others see to this share goes");
  s.number("mapping.view_keyframes", c.mapping.view.keyframes, 1, 500, "",
           "keyframes around the newest that tracking matches against");
  s.number("mapping.view_landmarks", c.mapping.view.landmarks, 100, 100000, "",
           "landmarks that tracking matches against");
  s.number("noise.sigma_px", c.mapping.noise.sigma_px, 0.05, 10.0, "px",
           "localisation noise of a corner at pyramid level 0");
  s.number("noise.depth_sigma_scale", c.mapping.noise.depth_sigma_scale, 0.1, 100.0, "",
           "noise of a corner's depth in units of the Kinect's on a plane");
  s.number("noise.edge_weight", c.mapping.noise.edge_weight, 0.001, 1.0, "",
           "highest weight of a corner where surfaces at different depths meet");
  s.number("dense.voxel_m", c.dense.voxel_m, 0.001, 1.0, "m", "side of a voxel of map.ply");
  s.number("dense.max_depth_m", c.dense.max_depth_m, 0.1, 6.5, "m", "farther depth is left out");
  s.number("dense.pixel_stride", c.dense.pixel_stride, 1, 16, "px", "every n-th pixel is used");
  s.number("dense.margin_px", c.dense.margin_px, 0, 50, "px", "left out around masks");
  s.number("dense.min_points", c.dense.min_points, 1, 100, "", "measurements that make a voxel");
}

}  // namespace

ConfigSchema schema_of(SlamConfig& config) {
  ConfigSchema schema;
  add_input_keys(schema, config);
  add_motion_keys(schema, config.dynamic);
  add_segment_keys(schema, config.segment);
  add_tracking_keys(schema, config.tracking);
  add_mapping_keys(schema, config);
  return schema;
}

}  // namespace ygslam
