#include "app/commands.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/exit_code.hpp"
#include "app/program_log.hpp"
#include "app/progress_bar.hpp"
#include "app/simulate_inertial.hpp"
#include "app/simulate_options.hpp"
#include "app/simulate_poses.hpp"
#include "app/simulate_random.hpp"
#include "app/simulation_outputs.hpp"
#include "app/stop_signal.hpp"
#include "core/bounded_queue.hpp"
#include "core/worker_thread.hpp"
#include "io/atomic_file.hpp"
#include "io/depth_calibration.hpp"
#include "simulation/sequence/sequence_source.hpp"
#include "system/metrics.hpp"

namespace ygslam {

namespace {

/// Renders in this thread and writes in another, so that neither waits for the other.
/// @return how many frames; if a signal came before the first, no lists are written, for a sequence
/// of none would look whole.
Result<int> render(sim::SequenceSource& source, SimulationOutputs& outputs) {
  BoundedQueue<std::shared_ptr<const sim::SimulatedFrame>> queue(4, Overflow::kBlock);
  std::optional<Error> failure;
  std::atomic<bool> failed{false};
  WorkerThread writing(
      [&](const std::stop_token& stop) {
        while (auto frame = queue.pop(stop)) {
          if (failure) continue;
          if (Status status = outputs.add(**frame, source); !status) {
            failure = status.error();
            failed = true;
          }
        }
      },
      [&] { queue.close(); });
  const auto start = std::chrono::steady_clock::now();
  int done = 0;
  ProgressBar bar(static_cast<std::size_t>(source.frame_count()), is_quiet());
  while (!failed && StopSignal::received() == 0) {
    auto rendered = source.next_with_losses();
    if (!rendered) break;
    const auto frame = std::make_shared<const sim::SimulatedFrame>(std::move(*rendered));
    log_detail(fmt::format("frame {} of {}", done + 1, source.frame_count()));
    if (!queue.push(frame)) break;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    ++done;
    bar.update(static_cast<std::size_t>(done),
               fmt::format("{:.1f} frames/s", done / std::max(1e-3, elapsed.count())));
    if (!outputs.show(*frame, source)) break;
  }
  queue.close();
  writing.join();
  writing.rethrow();
  if (failure) return *failure;
  if (done == 0) return 0;
  if (Status status = outputs.finish(source); !status) return status.error();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  log::info("{} frames in {:.1f} s ({:.1f} per second)", done, elapsed.count(),
            done / std::max(1e-3, elapsed.count()));
  return done;
}

/// How the sequence was made, for whoever finds it later (`ygslam bench` for one).
Status write_origin(const SimulateArguments& arguments, const sim::SequenceSource& source,
                    int frames) {
  nlohmann::ordered_json json = {
      {"format", 1},
      {"world", std::filesystem::path(arguments.world).filename().string()},
      {"frames", frames},
      {"fps", source.fps()},
      {"seed", arguments.options.seed},
      {"size", arguments.size},
      {"noise", arguments.noise},
      {"without", arguments.without},
      {"faults", arguments.faults},
      {"blur", arguments.options.blur},
      {"rolling", arguments.options.rolling},
      {"depth_rolling", arguments.options.depth_rolling.value_or(arguments.options.rolling)},
      {"depth_delay_ms", arguments.options.depth_delay_ms},
      {"exposure_drift", arguments.options.exposure_drift},
      {"distortion", arguments.options.distortion},
      {"depth_camera", source.depth_camera() ? nlohmann::ordered_json(
                                                   format_depth_calibration(*source.depth_camera()))
                                             : nlohmann::ordered_json()}};
  tell_inertial(arguments.inertial, json);
  json["version"] = version();
  return write_file_atomically(
      std::filesystem::path(arguments.out) / "simulation.json",
      json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

Status simulate(SimulateArguments arguments) {
  const sim::SequenceOptions& o = arguments.options;
  if (arguments.list) {
    for (const sim::WorldName& world : sim::known_worlds())
      std::printf("%-28s %s\n", world.name.c_str(), world.description.c_str());
    return Ok{};
  }
  if (Status status = complete_options(arguments); !status) return status;
  if (arguments.random) {
    sim::RandomFramesOptions random;
    random.seed = o.seed;
    random.width = o.width;
    random.height = o.height;
    random.threads = o.threads;
    return write_random_frames(arguments.out, *arguments.random, random);
  }
  const Result<sim::WorldConfig> world = sim::load_world(arguments.world);
  if (!world) return world.error();
  if (Status checked = check_sequence_files(arguments); !checked.ok()) return checked;
  if (!arguments.camera.empty()) {
    const double fps = arguments.options.fps.value_or(world->fps);
    if (Status taken = take_shutter(arguments.camera, fps, arguments.options); !taken) return taken;
  }
  Result<sim::SequenceSource> source = sim::open_world(*world, arguments.options);
  if (!source) return source.error();
  if (StopSignal::received() != 0) return Ok{};  // what is in the folder already stays
  Result<SimulationOutputs> outputs =
      open_outputs(*source, arguments.out, arguments.mcap, arguments.view,
                   arguments.mcap.empty() ? RecordedSensors{}
                                          : recorded_sensors(*source, arguments.inertial, o.seed),
                   {.jpeg = arguments.format == "jpg", .truth = arguments.truth});
  if (!outputs) return outputs.error();
  const Result<int> frames = arguments.poses.empty()
                                 ? render(*source, *outputs)
                                 : render_poses(arguments.poses, *source, *outputs);
  if (!frames) return frames.error();
  if (*frames > 0 && outputs->files) {
    Status status = write_inertial(arguments.out, *source, arguments.inertial, o.seed, *frames,
                                   arguments.truth);
    if (status.ok()) status = write_origin(arguments, *source, *frames);
    if (!status.ok()) return status;
  }
  if (*frames > 0 && outputs->view && arguments.view.stay) {
    outputs->view->finish(nullptr);
    const bool is_whole = StopSignal::received() == 0;
    log::info("the page stays until it is interrupted (Ctrl-C)");
    outputs->view->stay([] { return StopSignal::received() != 0; });
    if (is_whole) StopSignal::forget();
  }
  return Ok{};
}

}  // namespace

void add_simulate_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command = app.add_subcommand("simulate", "Render an RGB-D sequence with exact truth");
  add_simulate_options(*command, *arguments);
  command->callback([arguments, &exit_code] {
    StopSignal::watch();
    exit_code = exit_code_of(simulate(*arguments));
  });
}

}  // namespace ygslam
