#include "app/simulate_options.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cstdio>
#include <set>
#include <string>

#include "app/file_uses.hpp"
#include "app/option_checks.hpp"
#include "app/simulate_poses.hpp"
#include "io/camera_devices.hpp"
#include "io/depth_calibration.hpp"
#include "simulation/sequence/inertial_files.hpp"

namespace ygslam {
namespace {

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

void add_simulate_options(CLI::App& command, SimulateArguments& a) {
  command.add_option("world", a.world, "A known world (--list) or a .yaml file");
  command
      .add_option("--out", a.out,
                  "Folder for the sequence (TUM layout); REQUIRED but with --list, --mcap, --view")
      ->type_name("DIR");
  command.add_flag("--list", a.list, "List the known worlds");
  command.add_option("--seconds", a.options.seconds, "Length [s] (default: the world's)")
      ->check(in_range(1e-6, 1e6))
      ->type_name("S");
  command.add_option("--fps", a.options.fps, "Frames per second (default: the world's)")
      ->check(in_range(1.0, 240.0))
      ->type_name("N");
  command.add_option("--seed", a.options.seed, "Seed of the hand's jerks, noise and faults")
      ->check(in_range(std::uint64_t{0}, std::uint64_t{1} << 53U))
      ->type_name("N")
      ->capture_default_str();
  command.add_option("--size", a.size, "Image size")
      ->type_name("WIDTHxHEIGHT")
      ->capture_default_str();
  command.add_option("--noise", a.noise, "Sensor model")
      ->check(CLI::IsMember({"none", "kinect"}))
      ->capture_default_str();
  command.add_option("--format", a.format, "Colour images as jpg (quality 95) or png")
      ->check(CLI::IsMember({"jpg", "png"}))
      ->capture_default_str();
  command.add_flag("--truth", a.truth, "Also write the truth, below");
  command.add_option("--without", a.without, "Leave out people, or all movers")
      ->check(CLI::IsMember({"people", "movers"}))
      ->allow_extra_args(false);  // else it would take the world's name for another
  command.add_option("--fault", a.faults, "A fault, e.g. depth:stuck@12s+2s (may be repeated)")
      ->type_name("KIND@TIME")
      ->allow_extra_args(false);
  command.add_option("--blur", a.options.blur, "Motion blur: exposure time / frame time")
      ->check(in_range(0.0, 1.0))
      ->type_name("0..1");
  CLI::Option* rolling =
      command
          .add_option("--rolling", a.options.rolling, "Rolling shutter: read-out time / frame time")
          ->check(in_range(0.0, 1.0))
          ->type_name("0..1");
  CLI::Option* depth_rolling =
      command
          .add_option("--depth-rolling", a.options.depth_rolling,
                      "The same of the depth image (default: as --rolling)")
          ->check(in_range(0.0, 1.0))
          ->type_name("0..1");
  command
      .add_option("--camera", a.camera,
                  "Read the rows as this camera does, e.g. kinect_v1 (docs/camera.md)")
      ->type_name("NAME")
      ->excludes(rolling)
      ->excludes(depth_rolling);
  command
      .add_option("--depth-delay-ms", a.options.depth_delay_ms,
                  "The depth image is taken so much later than the colour image")
      ->check(in_range(-100.0, 100.0))
      ->type_name("MS");
  command.add_flag("--distortion", a.options.distortion, "A lens that bends lines (TUM freiburg1)");
  command
      .add_option("--exposure-drift", a.options.exposure_drift,
                  "How far the exposure wanders, 0.15 = by 15 %")
      ->check(in_range(0.0, 0.9))
      ->type_name("0..0.9");
  command.add_option("--threads", a.options.threads, "Rendering threads")
      ->check(in_range(1, 256))
      ->type_name("N")
      ->capture_default_str();
  command
      .add_option("--depth-camera", a.depth_camera,
                  "Depth is taken by a camera of its own, as calibration_depth.txt says: not "
                  "registered to colour")
      ->type_name("FILE");
  command
      .add_option("--mcap", a.mcap,
                  "Record it as a camera's messages, with the true pose; `ygslam run` reads it")
      ->type_name("FILE");
  command
      .add_option("--poses", a.poses,
                  "A frame for each line 'seconds tx ty tz qx qy qz qw' (pose of the camera in the "
                  "world, seconds since the start) of this file, or of standard input (-), "
                  "instead of the world's path. Once its images are there its stamp is told on "
                  "standard output")
      ->type_name("FILE")
      ->excludes("--seconds")
      ->excludes("--fps");
  add_inertial_options(command, a.inertial);
  add_view_options(command, a.view);
  CLI::Option* random = command.add_option(
      "--random", a.random,
      "Instead of a sequence: so many single frames of random rooms and people, for training");
  random->check(in_range(1, 10'000'000))->type_name("N");
  for (CLI::Option* other : command.get_options()) {
    static const std::set<std::string> kAlso = {"--help", "--out",     "--seed",
                                                "--size", "--threads", "--random"};
    if (!kAlso.contains(other->get_name())) random->excludes(other);
  }
  command.footer(kSimulateFooter);
}

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

}  // namespace ygslam
