// Single frames for training a network: other rooms, people, cameras and sensors every few frames.
//
//   RandomFrames frames({.seed = 7});
//   while (...) use(frames.next());
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/result.hpp"
#include "geometry/camera.hpp"
#include "image/image.hpp"

namespace ygslam::sim {

struct RandomFramesOptions {
  std::uint64_t seed = 1;
  int width = 320, height = 240;  ///< [px]
  int shots = 12;                 ///< frames of one world
  int texture_size = 128;         ///< [texels]
  int threads = 2;
};

/// One frame as a depth camera might deliver it, and which pixels are people.
struct RandomFrame {
  int world = 0;  ///< counts from 0
  int shot = 0;   ///< of the world; those in which the camera sees next to nothing are left out
  CameraConfig camera;
  ColourImage colour;
  DepthImage depth_m;  ///< with noise, holes and shadows, 0 = none
  GreyImage people;    ///< 0 = nobody, else the number of the person
};

/// An endless stream; the same bytes for the same options, whatever the number of threads.
class RandomFrames {
 public:
  /// @return kUsage for sizes that cannot be.
  [[nodiscard]] static Result<RandomFrames> open(const RandomFramesOptions& options);
  RandomFrames(RandomFrames&&) noexcept;
  RandomFrames& operator=(RandomFrames&&) noexcept;
  ~RandomFrames();

  [[nodiscard]] RandomFrame next();

 private:
  struct State;
  explicit RandomFrames(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace ygslam::sim
