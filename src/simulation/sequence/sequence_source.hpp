// A rendered RGB-D sequence with its truth, frame by frame, without files: what tests feed the
// system.
//
//   auto source = open_world("walking_xyz", {.seconds = 2, .width = 320, .height = 240});
//   while (auto frame = source->next()) system.process(frame->frame);
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "geometry/camera.hpp"
#include "image/rgbd_frame.hpp"
#include "io/depth_registration.hpp"
#include "simulation/sensor/faults.hpp"
#include "simulation/sensor/sensor_noise.hpp"
#include "simulation/world/world_config.hpp"

namespace ygslam::sim {

struct SequenceOptions {
  std::optional<double> seconds;  ///< default: as the world says
  std::optional<double> fps;      ///< the same
  std::uint64_t seed = 1;         ///< of the hand's jerks, the noise and the faults
  NoiseKind noise = NoiseKind::kNone;
  int width = 640, height = 480;  ///< [px]; the intrinsics are scaled along
  bool without_people = false;    ///< and without what they carry or push
  bool without_movers = false;    ///< nothing moves
  bool truth_static = false;      ///< also render the view without movers
  bool truth_things = false;      ///< also tell which thing each pixel shows
  bool antialias = true;
  bool distortion = false;              ///< the lens of TUM freiburg1
  double blur = 0;                      ///< exposure time / frame time, 0 = no motion blur
  double rolling = 0;                   ///< time between first and last row / frame time
  std::optional<double> depth_rolling;  ///< the same of the depth image, if it differs
  double depth_delay_ms = 0;  ///< middle row of the depth image after that of the colour image
  /// Takes the depth images, which then are not registered to colour; width and height > 0.
  std::optional<DepthCamera> depth_camera;
  double exposure_drift = 0;  ///< how far the exposure wanders, e.g. 0.15 = by 15 %
  std::vector<Fault> faults;
  int texture_size = 512;  ///< smaller builds faster [texels]
  int threads = 2;
};

/// A frame as the sensor delivers it, and the truth.
struct SimulatedFrame {
  FramePtr frame;      ///< with noise and faults; stamp as delivered; depth as its camera took it
  int index = 0;       ///< of the frame, counting those that faults dropped
  double t_s = 0;      ///< true time since the start
  SE3 T_world_camera;  ///< true pose, optical frame
  DepthImage depth_true_m;
  GreyImage ids;           ///< instance id of the mover at each pixel, 0 = fixed scene
  GreyImage moving;        ///< 255 where the surface moved 5 mm or more since the previous frame
  GreyImage things;        ///< NamedThing::id at each pixel, 0 = none; empty unless asked for
  ColourImage rgb_static;  ///< without movers; empty unless asked for
  DepthImage depth_static_m;
  Delivery delivery;  ///< what of the frame arrives
};

class SequenceSource {
 public:
  SequenceSource(SequenceSource&&) noexcept;
  SequenceSource& operator=(SequenceSource&&) noexcept;
  ~SequenceSource();

  /// The next frame that arrives with both its images; nullopt at the end.
  [[nodiscard]] std::optional<SimulatedFrame> next();
  /// The next frame, even if a fault ate it or one of its images (see `delivery`).
  [[nodiscard]] std::optional<SimulatedFrame> next_with_losses();

  /// The frame of a camera that a caller moves, instead of along the world's path; it stands while
  /// the frame is taken. @param t_s since the start, later than that of the frame before.
  [[nodiscard]] SimulatedFrame next_from(const SE3& T_world_camera, double t_s);

  [[nodiscard]] int frame_count() const;
  [[nodiscard]] const Camera& camera() const;
  [[nodiscard]] const std::optional<DepthCamera>& depth_camera() const;
  [[nodiscard]] double fps() const;
  [[nodiscard]] const WorldConfig& world() const;
  /// Class of every instance id that can occur.
  [[nodiscard]] std::map<int, std::string> instance_classes() const;
  /// Name and pose of every mover at a time.
  [[nodiscard]] std::vector<std::pair<std::string, SE3>> mover_poses(double t_s) const;
  [[nodiscard]] SE3 T_world_camera(double t_s) const;
  [[nodiscard]] const CameraPath& path() const;
  /// The stamp of t_s = 0.
  [[nodiscard]] Timestamp start() const;
  [[nodiscard]] const Scene& scene() const;

 private:
  friend Result<SequenceSource> open_world(const WorldConfig&, const SequenceOptions&);
  struct State;
  explicit SequenceSource(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// @param name_or_file a known world or a .yaml file. @return kUsage for an unknown name (the
/// message lists the known ones), kInput for a faulty file (naming key and line).
[[nodiscard]] Result<SequenceSource> open_world(const std::string& name_or_file,
                                                const SequenceOptions& options = {});
[[nodiscard]] Result<SequenceSource> open_world(const WorldConfig& world,
                                                const SequenceOptions& options = {});

}  // namespace ygslam::sim
