// Builds a runner from settings: the one place where options, model and camera come together.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/result.hpp"
#include "segment/given_masks.hpp"
#include "system/runner.hpp"

namespace ygslam {

enum class SegmenterKind { kModel, kBuiltin, kNone, kMasks, kGiven };

/// Where neither a segmenter nor a model is named.
inline constexpr SegmenterKind kDefaultSegmenter = SegmenterKind::kBuiltin;

struct SessionOptions {
  SlamConfig config;  ///< resolved (slam_config.hpp)
  CameraConfig camera;
  SegmenterKind segmenter = kDefaultSegmenter;
  std::filesystem::path model;          ///< for kModel
  std::filesystem::path masks_dir;      ///< for kMasks
  std::shared_ptr<GivenMasks> given{};  ///< for kGiven
  std::filesystem::path load_map;       ///< of an earlier run, to go on with; empty = none
  bool localize_only = false;           ///< the loaded map stays as it is
  MapSink map_sink;                     ///< see MapUse; may be empty
  DenseSink dense_sink;                 ///< the same
  std::string without_model =  ///< what to do without a network, for the error that says so
      "--segmenter none, --segmenter masks:DIR or --dynamic geometry";
  bool deterministic = false;
  bool may_fork = false;  ///< a model is first read in a child process, which it may bring down
  bool may_wait = false;  ///< frames come out of a file: nothing is missed while masks are awaited
};

struct Session {
  std::unique_ptr<Camera> camera;  ///< the runner refers to it
  std::unique_ptr<Runner> runner;
  std::string segmenter;             ///< segmenter_name() of the one that is used
  std::string precision;             ///< of the segmenter, "" without one
  std::filesystem::path dense_file;  ///< that it goes on with; empty = none
};

/// What users write: model, builtin, none or masks:DIR; empty: model where there is one, else
/// kDefaultSegmenter. @param choices that an error names. @return kUsage.
[[nodiscard]] Status choose_segmenter(
    const std::string& words, const std::filesystem::path& model, SessionOptions& options,
    std::string_view choices = "model, builtin, none or masks:DIR");
/// "model", "builtin", "masks", "frames" (kGiven) or "none".
[[nodiscard]] std::string segmenter_name(SegmenterKind kind);

/// A session's segmenter; null where it has none. Errors as open_session().
[[nodiscard]] Result<std::unique_ptr<Segmenter>> open_segmenter(const SessionOptions& options);

/// Modes off and geometry use no segmenter, whatever the options say.
/// @return kModel: no model given where one is needed (says how to get one) or unreadable;
/// kConfig: see validate() and camera_faults(), precision the model has not; kInput: no masks in
/// the folder; kSavedMap: see load_map(), or nothing to localise in.
[[nodiscard]] Result<Session> open_session(SessionOptions options);

}  // namespace ygslam
