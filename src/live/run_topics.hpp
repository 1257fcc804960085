// The messages of the topics of a run, for whoever wants them.
#pragma once

#include <array>
#include <cstddef>

#include "dense/scene_naming/named_scene.hpp"
#include "live/mesh_tiles.hpp"
#include "live/message_sink.hpp"
#include "live/run_messages.hpp"
#include "live/topics.hpp"
#include "system/runner.hpp"

namespace ygslam {

void publish_frame(const RgbdFrame& frame, const TrackResult& result, const CameraConfig& camera,
                   MessageSink& sink);
/// The topics of the map but those of the mesh.
/// @param most_points of the cloud. @param mesh where it was taken already: the cloud is of it.
void publish_map(Runner& runner, Timestamp stamp, std::size_t most_points, MessageSink& sink,
                 const NamedMesh* mesh = nullptr);
/// Whether any of the map's topics is wanted, the mesh's included.
[[nodiscard]] bool wants_map(const MessageSink& sink);

/// The topics of the mesh of one run.
class MeshTopics {
 public:
  [[nodiscard]] static bool wanted(const MessageSink& sink);
  [[nodiscard]] static NamedMesh take(Runner& runner);

  enum class Extent {
    kTiles,    ///< each tile that changed as a message of its own, which is a part of the topic
    kChanged,  ///< those that changed in one message
    kWhole     ///< all of them, in one message that erases what was there before
  };
  void publish(NamedMesh named, Timestamp stamp, Extent extent, MessageSink& sink);

 private:
  struct Topic {
    const char* name;
    MeshTiles tiles;
  };
  std::array<Topic, 2> topics_{Topic{"/mesh", MeshTiles(MeshTiles::Colours::kSeen)},
                               Topic{"/mesh/classes", MeshTiles(MeshTiles::Colours::kClasses)}};
  double cell_m_ = 0;  // no finer again in this world, so that it does not flicker
};

}  // namespace ygslam
