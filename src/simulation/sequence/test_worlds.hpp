// Small worlds for the tests of simulation/.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "simulation/sequence/sequence_source.hpp"

namespace ygslam::sim {

/// Options that build and render fast.
inline SequenceOptions small_options(double seconds, double fps) {
  SequenceOptions options;
  options.seconds = seconds;
  options.fps = fps;
  options.width = 160;
  options.height = 120;
  options.texture_size = 64;
  return options;
}

inline SequenceSource open_or_die(const std::string& name, const SequenceOptions& options) {
  Result<SequenceSource> source = open_world(name, options);
  CHECK(source.ok(), source ? "" : source.error().message.c_str());
  return std::move(source).value();
}

inline std::vector<SimulatedFrame> all_frames(SequenceSource source) {
  std::vector<SimulatedFrame> frames;
  while (auto frame = source.next_with_losses()) frames.push_back(std::move(*frame));
  return frames;
}

template <typename T>
bool same_pixels(const Image<T>& a, const Image<T>& b) {
  return a.same_size(b) && std::equal(a.begin(), a.end(), b.begin());
}

}  // namespace ygslam::sim
