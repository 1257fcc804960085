#include "app/commands.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/exit_code.hpp"
#include "app/file_uses.hpp"
#include "app/option_checks.hpp"
#include "app/program_log.hpp"
#include "app/progress_bar.hpp"
#include "app/simulate_inertial.hpp"
#include "app/simulate_poses.hpp"
#include "app/simulate_random.hpp"
#include "app/simulation_outputs.hpp"
#include "app/stop_signal.hpp"
#include "core/bounded_queue.hpp"
#include "core/worker_thread.hpp"
#include "io/atomic_file.hpp"
#include "io/calibration.hpp"
#include "io/camera_devices.hpp"
#include "io/depth_calibration.hpp"
#include "simulation/sequence/sequence_source.hpp"
#include "simulation/sequence/sequence_writer.hpp"
#include "system/metrics.hpp"

namespace ygslam {

namespace {

struct SimulateArguments {
  std::string world;
  std::string out;
  bool list = false;
  std::optional<int> random;  // frames
  bool truth = false;
  std::string size = "640x480";
  std::string noise = "kinect";
  std::string format = "jpg";
  std::string camera;
  std::string depth_camera;
  std::string mcap;
  std::string poses;
  ViewOptions view;
  std::vector<std::string> without;
  std::vector<std::string> faults;
  sim::SequenceOptions options;
  InertialOptions inertial;
};

Status complete_options(SimulateArguments& arguments) {
  int width = 0;
  int height = 0;
  char rest = 0;
  if (std::sscanf(arguments.size.c_str(), "%dx%d%c", &width, &height, &rest) != 2) {
    return Error{ErrorKind::kUsage, "--size wants WIDTHxHEIGHT, not '" + arguments.size + "'"};
  }
  arguments.options.width = width;
  arguments.options.height = height;
  arguments.options.noise =
      arguments.noise == "kinect" ? sim::NoiseKind::kKinect : sim::NoiseKind::kNone;
  arguments.options.truth_static = arguments.options.truth_things = arguments.truth;
  for (const std::string& what : arguments.without) {
    arguments.options.without_people |= what == "people";
    arguments.options.without_movers |= what == "movers";
  }
  for (const std::string& text : arguments.faults) {
    Result<sim::Fault> fault = sim::parse_fault(text);
    if (!fault) return fault.error();
    arguments.options.faults.push_back(*fault);
  }
  if (!arguments.depth_camera.empty()) {
    Result<DepthCamera> depth = read_depth_calibration(arguments.depth_camera);
    if (!depth) return depth.error();
    if (depth->camera.width <= 0 || depth->camera.height <= 0)
      return Error{ErrorKind::kUsage, arguments.depth_camera + ": width and height are missing"};
    constexpr double kScale = 5000;  // of TUM's files
    if (depth->camera.depth_scale == 0) depth->camera.depth_scale = kScale;
    arguments.options.depth_camera = *depth;
  }
  if (arguments.out.empty() && arguments.mcap.empty() && !arguments.view.address)
    return Error{ErrorKind::kUsage, "--out DIR is missing (or --mcap, --view)"};
  if (arguments.out.empty() && arguments.truth)
    return Error{ErrorKind::kUsage, "--truth is written to --out DIR, which is missing"};
  if (arguments.out.empty() && arguments.mcap.empty() && arguments.inertial.any())
    return Error{ErrorKind::kUsage, "--imu and --wheels need --out DIR or --mcap FILE"};
  if (arguments.random) return Ok{};
  if (arguments.world.empty())
    return Error{ErrorKind::kUsage, "which world? --list shows the known ones"};
  return Ok{};
}

/// Reads the rows as a camera one can buy does.
Status take_shutter(const std::string& name, double fps, sim::SequenceOptions& options) {
  // A Kinect's depth, registered to colour, takes a little longer than a frame.
  constexpr double kMostShare = 1.05;
  CameraConfig camera;
  if (const auto fault = apply_device(name, camera))
    return Error{ErrorKind::kUsage, "--camera: " + fault->reason};
  if (!find_camera_device(name)->is_known()) {
    return Error{ErrorKind::kUsage,
                 "--camera " + name + ": nobody published its read-out time; give --rolling"};
  }
  options.rolling = 1e-3 * camera.colour_readout_ms * fps;
  options.depth_rolling = 1e-3 * camera.depth_readout_ms * fps;
  if (std::max(options.rolling, *options.depth_rolling) > kMostShare) {
    return Error{ErrorKind::kUsage,
                 fmt::format("--camera {}: reads an image in {:.0f} ms, too slow for {:g} frames "
                             "per second",
                             name, camera.depth_readout_ms, fps)};
  }
  return Ok{};
}

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

Status check_sequence_files(const SimulateArguments& a) {
  FileUses uses;
  uses.reads("world", a.world);
  uses.reads("--depth-camera", a.depth_camera);
  if (a.poses != kStandardInput) uses.reads("--poses", a.poses);
  uses.writes("--mcap", a.mcap);
  uses.writes_in(
      "--out", a.out,
      {"rgb/*.jpg", "rgb/*.png", "depth/*.png", "rgb.txt", "depth.txt", "associations.txt",
       "groundtruth.txt", "calibration.txt", "calibration_depth.txt", "simulation.json",
       sim::kImuReadings, sim::kImuPlace, sim::kWheelPoses, sim::kWheelPlace});
  if (a.truth)
    uses.writes_in(
        "--out", a.out,
        {"mask/*.png", "things/*.png", "things/instances.json", "moving/*.png", "depth_true/*.png",
         "rgb_static/*.jpg", "rgb_static/*.png", "depth_static/*.png", "movers/*.txt",
         "instances.json", "true_objects.json", "static.ply", sim::kImuTruth});
  return uses.check();
}

Status simulate(SimulateArguments arguments) {
  // CLI11's ranges let NaN through.
  const sim::SequenceOptions& o = arguments.options;
  for (const double value : {o.seconds.value_or(0), o.fps.value_or(0), o.blur, o.rolling,
                             o.depth_rolling.value_or(0), o.depth_delay_ms, o.exposure_drift}) {
    if (!std::isfinite(value))
      return Error{ErrorKind::kUsage, "a number among the options is not finite"};
  }
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

constexpr const char* kSimulateFooter =
    "Examples:\n"
    "  ygslam simulate --list\n"
    "  ygslam simulate walking_xyz --out wx --truth\n"
    "  ygslam simulate crowd --out c --seconds 10 --fault depth:stuck@4s+2s --blur 0.3\n"
    "  ygslam simulate robot_rounds --out r --imu BMI085 --wheels\n"
    "  ygslam simulate --random 1000 --out frames --size 320x240\n"
    "Writes rgb/, depth/, rgb.txt, depth.txt, associations.txt, groundtruth.txt, calibration.txt "
    "and\n"
    "simulation.json (how it was made), with --depth-camera calibration_depth.txt, with --imu "
    "imu.csv and\n"
    "imu.yaml, with --wheels odom.csv, odom.yaml; --random: images in folders and frames.csv. "
    "--truth adds\n"
    "mask/ (ids of people and movers, named in instances.json), things/ (ids of all things),\n"
    "moving/ (what moved since the frame before), depth_true/, rgb_static/ and depth_static/ (the "
    "view\n"
    "without movers), movers/ (their poses), true_objects.json, static.ply (the room's surface) "
    "and\n"
    "imu_true.csv (poses, velocities and biases of the --imu).\n"
    "See docs/rendered-world.md. Exit codes: 0 ok, 2 usage, 3 a depth camera that is wrong,\n"
    "4 a world that is wrong, 9 output not written.";

}  // namespace

void add_simulate_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<SimulateArguments>();
  SimulateArguments& a = *arguments;
  CLI::App* command = app.add_subcommand("simulate", "Render an RGB-D sequence with exact truth");
  command->add_option("world", a.world, "A known world (--list) or a .yaml file");
  command
      ->add_option("--out", a.out,
                   "Folder for the sequence (TUM layout); REQUIRED but with --list, --mcap, --view")
      ->type_name("DIR");
  command->add_flag("--list", a.list, "List the known worlds");
  command->add_option("--seconds", a.options.seconds, "Length [s] (default: the world's)")
      ->type_name("S");
  command->add_option("--fps", a.options.fps, "Frames per second (default: the world's)")
      ->type_name("N");
  command->add_option("--seed", a.options.seed, "Seed of the hand's jerks, noise and faults")
      ->check(in_range(std::uint64_t{0}, std::uint64_t{1} << 53U))
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--size", a.size, "Image size")
      ->type_name("WIDTHxHEIGHT")
      ->capture_default_str();
  command->add_option("--noise", a.noise, "Sensor model")
      ->check(CLI::IsMember({"none", "kinect"}))
      ->capture_default_str();
  command->add_option("--format", a.format, "Colour images as jpg (quality 95) or png")
      ->check(CLI::IsMember({"jpg", "png"}))
      ->capture_default_str();
  command->add_flag("--truth", a.truth, "Also write the truth, below");
  command->add_option("--without", a.without, "Leave out people, or all movers")
      ->check(CLI::IsMember({"people", "movers"}))
      ->allow_extra_args(false);  // else it would take the world's name for another
  command->add_option("--fault", a.faults, "A fault, e.g. depth:stuck@12s+2s (may be repeated)")
      ->type_name("KIND@TIME")
      ->allow_extra_args(false);
  command->add_option("--blur", a.options.blur, "Motion blur: exposure time / frame time")
      ->check(in_range(0.0, 1.0))
      ->type_name("0..1");
  CLI::Option* rolling = command
                             ->add_option("--rolling", a.options.rolling,
                                          "Rolling shutter: read-out time / frame time")
                             ->check(in_range(0.0, 1.0))
                             ->type_name("0..1");
  CLI::Option* depth_rolling =
      command
          ->add_option("--depth-rolling", a.options.depth_rolling,
                       "The same of the depth image (default: as --rolling)")
          ->check(in_range(0.0, 1.0))
          ->type_name("0..1");
  command
      ->add_option("--camera", a.camera,
                   "Read the rows as this camera does, e.g. kinect_v1 (docs/camera.md)")
      ->type_name("NAME")
      ->excludes(rolling)
      ->excludes(depth_rolling);
  command
      ->add_option("--depth-delay-ms", a.options.depth_delay_ms,
                   "The depth image is taken so much later than the colour image")
      ->check(in_range(-100.0, 100.0))
      ->type_name("MS");
  command->add_flag("--distortion", a.options.distortion,
                    "A lens that bends lines (TUM freiburg1)");
  command
      ->add_option("--exposure-drift", a.options.exposure_drift,
                   "How far the exposure wanders, 0.15 = by 15 %")
      ->check(in_range(0.0, 0.9))
      ->type_name("0..0.9");
  command->add_option("--threads", a.options.threads, "Rendering threads")
      ->check(in_range(1, 256))
      ->type_name("N")
      ->capture_default_str();
  command
      ->add_option("--depth-camera", a.depth_camera,
                   "Depth is taken by a camera of its own, as calibration_depth.txt says: not "
                   "registered to colour")
      ->type_name("FILE");
  command
      ->add_option("--mcap", a.mcap,
                   "Record it as a camera's messages, with the true pose; `ygslam run` reads it")
      ->type_name("FILE");
  command
      ->add_option(
          "--poses", a.poses,
          "A frame for each line 'seconds tx ty tz qx qy qz qw' (pose of the camera in the "
          "world, seconds since the start) of this file, or of standard input (-), "
          "instead of the world's path. Once its images are there its stamp is told on "
          "standard output")
      ->type_name("FILE")
      ->excludes("--seconds")
      ->excludes("--fps");
  add_inertial_options(*command, a.inertial);
  add_view_options(*command, a.view);
  CLI::Option* random = command->add_option(
      "--random", a.random,
      "Instead of a sequence: so many single frames of random rooms and people, for training");
  random->check(in_range(1, 10'000'000))->type_name("N");
  for (CLI::Option* other : command->get_options()) {
    static const std::set<std::string> kAlso = {"--help", "--out",     "--seed",
                                                "--size", "--threads", "--random"};
    if (!kAlso.contains(other->get_name())) random->excludes(other);
  }
  command->footer(kSimulateFooter);
  command->callback([arguments, &exit_code] {
    StopSignal::watch();
    exit_code = exit_code_of(simulate(*arguments));
  });
}

}  // namespace ygslam
