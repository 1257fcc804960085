// Rendered sequences for the tests of the whole system.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "simulation/sequence/sequence_source.hpp"
#include "system/testing/trial.hpp"

namespace ygslam::system_test {

/// Small and coarsely sampled images, so that a test takes seconds.
inline sim::SequenceOptions small(double seconds) {
  sim::SequenceOptions options;
  options.seconds = seconds;
  options.fps = 20;
  options.width = 320;
  options.height = 240;
  options.texture_size = 256;
  options.antialias = false;
  return options;
}

inline Recording record_all(sim::SequenceSource& source) {
  Recording recording{source.camera(), {}, {}, {}};
  while (auto frame = source.next()) {
    recording.truth.push_back({frame->frame->stamp, frame->T_world_camera});
    recording.frames.push_back(std::move(frame->frame));
    recording.ids.push_back(std::move(frame->ids));
  }
  return recording;
}

/// @param world a name or file, or a world itself.
template <typename World>
Recording record(const World& world, const sim::SequenceOptions& options) {
  auto source = sim::open_world(world, options);
  CHECK(source.ok(), source.error().message.c_str());
  return record_all(*source);
}

/// record(world, small(seconds)), rendered once in a process: tests of a suite share it.
inline const Recording& record_once(const std::string& world, double seconds) {
  static std::map<std::pair<std::string, double>, Recording> rendered;
  const auto key = std::pair(world, seconds);
  const auto known = rendered.find(key);
  return known != rendered.end()
             ? known->second
             : rendered.emplace(key, record(world, small(seconds))).first->second;
}

}  // namespace ygslam::system_test
