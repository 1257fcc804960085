// What the user asked of `ygslam run`, checked and turned into settings.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "app/view_options.hpp"
#include "bag/bag_sequence.hpp"
#include "core/result.hpp"
#include "io/frame_reader.hpp"
#include "system/session.hpp"

namespace CLI {
class App;
}

namespace ygslam {

/// --segmenter of every command that has it.
inline constexpr const char* kSegmenterType = "model|builtin|none|masks:DIR";
inline constexpr const char* kSegmenterHelp =
    "Where masks come from: --model if given, else the built-in network that knows people; "
    "nowhere; "
    "files";

struct RunOptions {
  std::string sequence, out_dir;
  std::string model, segmenter, dynamic_mode;
  std::string camera_file, depth_camera_file, config_file, debug_dir, masks_dir;
  std::string imu, imu_calibration;            ///< empty: what the recording has
  std::string odometry, odometry_calibration;  ///< the same of wheels
  BagTopics topics;                            ///< where the sequence is a bag or a stream
  bool may_stream = false;                     ///< frames are looked at once, in their order
  std::string load_map, save_map, export_dir, background_dir;
  std::string mcap, trace;  ///< empty = none
  ViewOptions view;
  bool localize = false;          ///< in the loaded map, which stays as it is
  std::vector<std::string> sets;  ///< key=value
  std::size_t from = 0, to = 0, stride = 1;
  std::optional<std::uint64_t> seed;
  int debug_every = 1;
  bool realtime = false, deterministic = false;
  bool covariance = false;  ///< in trajectory_live.txt, and odometry.txt
};

/// SEQUENCE, where masks come from, camera, settings and seed.
void add_input_options(CLI::App& command, RunOptions& options);

/// --from and --to.
void add_range_options(CLI::App& command, RunOptions& options);

/// All of `ygslam run`, with its last words.
void declare_run_options(CLI::App& command, RunOptions& options);
/// All of `ygslam localize`.
void declare_localize_options(CLI::App& command, RunOptions& options);

/// Settings from defaults, --config, --set and the options, in this order; resolved. @return all
/// their faults at once (kConfig), or kUsage for --dynamic.
[[nodiscard]] Result<SlamConfig> load_settings(const RunOptions& options);
/// The sequence with the camera of --camera, if given. Waits for the first frames of a stream.
[[nodiscard]] Result<Sequence> open_sequence(const RunOptions& options);
/// kUsage where --from and --to leave no frame, as far as that is known.
[[nodiscard]] Status check_range(const RunOptions& options, const Sequence& sequence);

}  // namespace ygslam
