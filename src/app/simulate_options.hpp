// What `ygslam simulate` is asked.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/simulate_inertial.hpp"
#include "app/view_options.hpp"
#include "core/result.hpp"
#include "simulation/sequence/sequence_source.hpp"

namespace ygslam {

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

/// Must live as long as the command.
void add_simulate_options(CLI::App& command, SimulateArguments& arguments);

/// Turns the texts (--size, --fault, --depth-camera ...) into SequenceOptions. @return kUsage where
/// something is missing.
[[nodiscard]] Status complete_options(SimulateArguments& arguments);

/// Reads the rows as a camera one can buy does.
[[nodiscard]] Status take_shutter(const std::string& name, double fps,
                                  sim::SequenceOptions& options);

/// No file is read and written at once, or written twice.
[[nodiscard]] Status check_sequence_files(const SimulateArguments& arguments);

}  // namespace ygslam
