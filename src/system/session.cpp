#include "system/session.hpp"

#include "core/counted.hpp"
#include "core/log.hpp"
#include "io/calibration.hpp"
#include "map_file/map_file.hpp"
#include "segment/fallback_segmenter.hpp"
#include "segment/people_network.hpp"
#include "segment/recorded_masks.hpp"
#include "system/dense_beside.hpp"

namespace ygslam {
namespace {

/// What lies beside the map, if it is the map's.
Status add_dense(const std::filesystem::path& file, const Map& map, const Camera& camera,
                 MapUse& use, Session& session) {
  std::error_code code;
  if (!std::filesystem::exists(file, code)) return Ok{};
  auto dense = load_dense_beside(file, map, camera);
  if (!dense.ok()) return dense.error();
  if (!dense->foreign.empty()) {
    log::warn("{}: {}: it stays as it is, and this run goes on without a dense map", file.string(),
              dense->foreign);
    return Ok{};
  }
  log::info("{}: {}", file.string(), counted(dense->views.size(), "view"));
  use.dense = std::move(dense->views);
  session.dense_file = file;
  return Ok{};
}

Result<MapUse> open_map(const SessionOptions& options, const Camera& camera, Session& session) {
  MapUse use{{}, options.localize_only, options.map_sink, {}, options.dense_sink};
  if (options.load_map.empty()) {
    if (options.localize_only) return Error{ErrorKind::kUsage, "no map to localise in"};
    return use;
  }
  const OrbConfig& orb = options.config.orb;
  auto map = load_map(options.load_map, camera, {orb.levels, orb.scale_factor});
  if (!map.ok()) return map.error();
  if (options.localize_only && map->keyframes().empty())
    return Error{ErrorKind::kSavedMap,
                 options.load_map.string() + ": an empty map, nothing to localise in"};
  log::info("{}: {}, {}", options.load_map.string(), counted(map->keyframes().size(), "keyframe"),
            counted(map->landmark_count(), "landmark"));
  if (!options.localize_only && options.config.dense.enabled)
    if (Status added = add_dense(dense_file_of(options.load_map), *map, camera, use, session);
        !added.ok())
      return added.error();
  use.start = std::move(map).value();
  return use;
}

/// A camera does not wait for a model that is too large for the machine.
std::unique_ptr<Segmenter> with_fallback(std::unique_ptr<Segmenter> model,
                                         const SessionOptions& options) {
  const SegmentConfig& config = options.config.segment;
  if (!config.fallback) return model;
  // At its own precision: the one that was asked for is the model's.
  const auto builtin = [camera = options.camera, threads = config.network.threads] {
    return make_people_segmenter(camera, {Precision::kAuto, threads});
  };
  return make_fallback_segmenter(std::move(model), builtin);
}

}  // namespace

Status choose_segmenter(const std::string& words, const std::filesystem::path& model,
                        SessionOptions& options, std::string_view choices) {
  constexpr std::string_view kMasks = "masks:";
  options.model = model;
  if (words.empty()) {
    options.segmenter = model.empty() ? kDefaultSegmenter : SegmenterKind::kModel;
  } else if (words == "model") {
    options.segmenter = SegmenterKind::kModel;
  } else if (words == "builtin") {
    options.segmenter = SegmenterKind::kBuiltin;
  } else if (words == "none") {
    options.segmenter = SegmenterKind::kNone;
  } else if (words.starts_with(kMasks) && words.size() > kMasks.size()) {
    options.segmenter = SegmenterKind::kMasks;
    options.masks_dir = words.substr(kMasks.size());
  } else {
    return Error{ErrorKind::kUsage, "segmenter " + words + ": write " + std::string(choices)};
  }
  if (!model.empty() && options.segmenter != SegmenterKind::kModel)
    return Error{ErrorKind::kUsage, "model " + model.string() + ": segmenter " + words +
                                        " takes none; leave one of both out"};
  return Ok{};
}

std::string segmenter_name(SegmenterKind kind) {
  switch (kind) {
    case SegmenterKind::kModel:
      return "model";
    case SegmenterKind::kBuiltin:
      return "builtin";
    case SegmenterKind::kMasks:
      return "masks";
    case SegmenterKind::kGiven:
      return "frames";
    case SegmenterKind::kNone:
      break;
  }
  return "none";
}

Result<std::unique_ptr<Segmenter>> open_segmenter(const SessionOptions& options) {
  if (!uses_masks(options.config.dynamic.mode) || options.segmenter == SegmenterKind::kNone)
    return std::unique_ptr<Segmenter>();
  if (options.segmenter == SegmenterKind::kGiven) return make_given_segmenter(options.given);
  if (options.segmenter == SegmenterKind::kMasks) return make_recorded_segmenter(options.masks_dir);
  const ModelConfig& common = options.config.segment.network;
  if (options.segmenter == SegmenterKind::kBuiltin)
    return make_people_segmenter(options.camera, {common.precision, common.threads});
  if (options.model.empty()) {
    return Error{ErrorKind::kModel,
                 "--segmenter model needs --model FILE ('make model' exports one); or use "
                 "--segmenter builtin, " +
                     options.without_model};
  }
  ModelConfig network = common;
  network.model = options.model;
  network.try_in_child = options.may_fork;
  network.decode.classes = options.config.dynamic.masks.mask.movable.named();
  network.decode.others = true;  // for the dense map: what stands in the room
  return make_model_segmenter(network);
}

Result<Session> open_session(SessionOptions options) {
  if (Status valid = validate(options.config); !valid.ok()) return valid.error();
  if (const auto faults = camera_faults(options.camera); !faults.empty()) {
    return Error{ErrorKind::kConfig, "camera: " + faults.front().key + " " + faults.front().reason};
  }
  if (options.camera.width <= 0 || options.camera.height <= 0) {
    return Error{ErrorKind::kConfig, "camera: width and height must be positive"};
  }
  if (!options.localize_only)
    if (Status fits = fits_in_memory(options.config.dense); !fits.ok()) return fits.error();
  // Before anything else: a child that the model is tried in wants no other threads.
  auto segmenter = open_segmenter(options);
  if (!segmenter.ok()) return segmenter.error();

  Session session;
  session.segmenter = "none";
  if (*segmenter) {
    session.segmenter = segmenter_name(options.segmenter);
    session.precision = (*segmenter)->precision();
  }
  if (!options.may_wait) options.config.run.file_mask_lag_frames = 0;
  const bool may_be_late = !options.deterministic && !options.may_wait;
  if (options.segmenter == SegmenterKind::kModel && *segmenter && may_be_late)
    segmenter = with_fallback(std::move(*segmenter), options);
  session.camera = std::make_unique<Camera>(options.camera);
  auto map_use = open_map(options, *session.camera, session);
  if (!map_use.ok()) return map_use.error();
  const auto make = options.deterministic ? make_offline_runner : make_live_runner;
  session.runner =
      make(options.config, *session.camera, std::move(segmenter).value(), std::move(*map_use));
  return session;
}

}  // namespace ygslam
