// The live page of a run: shows it to whoever looks on, and lets those drive it who may.
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stop_token>

#include "core/bounded_queue.hpp"
#include "core/worker_thread.hpp"
#include "live/run_history.hpp"
#include "live/view_server.hpp"

namespace ygslam {

struct RunViewConfig {
  enum class Map {
    kResets,  ///< those who drive may begin the map anew
    kSaves,   ///< the run keeps a map file: they may save it now
    kNone,
  };
  ViewServerConfig server{};
  CameraConfig camera{};
  bool paced = false;   ///< the input comes at its own pace: slower and faster are refused
  bool paused = false;  ///< from the beginning
  bool driven = true;   ///< false: nobody may do anything but look on
  Map map = Map::kResets;
};

class RunView {
 public:
  /// @return as ViewServer::start().
  static Result<std::unique_ptr<RunView>> start(const RunViewConfig& config);
  ~RunView();

  /// After a frame was processed: it is shown by a thread of its own if somebody looks on.
  void show(const FramePtr& frame, const TrackResult& result);
  /// A frame was dropped, or could not be read.
  void miss() { ++missed_; }
  /// The map, if somebody wants it and it is time; asks the runner in this thread.
  void show_map(Runner& runner);

  /// Points of the world in place of a map, if somebody wants them and it is time; while it is
  /// paused, of each frame.
  /// @param make them: called where they are wanted.
  void show_cloud(const std::function<std::vector<ColouredPoint>()>& make);

  /// What those who drive asked for since the last time.
  struct Wishes {
    bool stop = false, save = false, reset = false;
    bool go = false;  ///< the frame is due
  };
  /// Waits until the frame is due (not while paused, nor before its time at the speed asked for)
  /// or something is wished.
  /// @param interrupted ends the wait when it says so. @param runner shows its map meanwhile; may
  /// be null.
  [[nodiscard]] Wishes wait_turn(Timestamp stamp, Runner* runner,
                                 const std::function<bool()>& interrupted);

  /// Asked to stop, once somebody who drives wishes it: for waits that frames do not end.
  [[nodiscard]] std::stop_token stop_token() const { return stop_.get_token(); }

  /// The runner was reset.
  void restart();
  /// The run has ended: shows the whole map as it is now, and says so.
  /// @param runner may be null.
  void finish(Runner* runner);
  /// Goes on showing it until `interrupted`, or somebody who drives stops it.
  void stay(const std::function<bool()>& interrupted);

  /// From any thread.
  [[nodiscard]] bool is_paused();

  [[nodiscard]] std::string url() const { return server_->url(); }

 private:
  struct Update {
    FramePtr frame;  ///< null: there was none yet
    std::shared_ptr<const TrackResult> result;
    bool is_state_alone = false;  ///< the rest of it was shown
  };
  struct MeshUpdate {
    NamedMesh mesh;
    Timestamp stamp;
  };
  using Clock = std::chrono::steady_clock;

  explicit RunView(const RunViewConfig& config) : config_(config), is_paused_(config.paused) {}
  class Batch;
  [[nodiscard]] bool is_picture_due();
  void publish(const Update& update);
  void publish_mesh(MeshUpdate update);
  void publish_history(Batch& batch, Timestamp stamp, bool is_told_now);
  Result<std::string> drive(std::string_view service);
  // Under the mutex.
  [[nodiscard]] std::string refusal(std::string_view service) const;  // empty: it can be done
  [[nodiscard]] std::string speed_text() const;
  [[nodiscard]] ros::DiagnosticStatus drive_status();
  void subscribed();
  void tell_state();                                 // under the mutex
  [[nodiscard]] bool is_due(Timestamp stamp) const;  // under the mutex

  const RunViewConfig config_;
  Clock::time_point map_due_, mesh_due_;  // the frame thread's, as what follows
  Timestamp now_;
  std::optional<Timestamp> last_stamp_;
  Clock::time_point last_turn_;

  std::stop_source stop_;
  std::atomic<std::uint64_t> missed_{0};  // frames
  std::atomic<bool> has_ended_{false};    // what is said then is kept for those who come later
  std::mutex mutex_;
  std::condition_variable changed_;
  // Under the mutex.
  bool is_paused_, step_ = false, map_wanted_ = false, history_wanted_ = false;
  double speed_ = 0;  // times real time; 0 = as fast as it goes
  Wishes wishes_;
  Update last_;
  RunHistory history_;

  /// Pushed to under the mutex, so that a state pushes no frame out.
  BoundedQueue<Update> updates_{1, Overflow::kDropOldest, "page"};
  BoundedQueue<MeshUpdate> meshes_{1, Overflow::kDropOldest, "page mesh"};
  Clock::time_point picture_due_, history_due_;  // the thread's that shows frames
  MeshTopics mesh_topics_;                       // the mesh thread's
  std::atomic<double> mesh_took_ms_{0};          // processor time of the last one
  std::unique_ptr<ViewServer> server_;
  std::optional<WorkerThread> thread_, mesh_thread_;  // last: they use everything above
};

}  // namespace ygslam
