#include "app/run_loop.hpp"

#include <tuple>

#include "app/frame_writer.hpp"
#include "app/progress_bar.hpp"
#include "app/recording_check.hpp"
#include "app/run_targets.hpp"
#include "app/stop_signal.hpp"
#include "io/frame_stream.hpp"
#include "io/text.hpp"
#include "live/run_recorder.hpp"
#include "system/dense_beside.hpp"

namespace ygslam {
namespace {

bool is_interrupted() { return StopSignal::received() != 0; }

/// Why not, by the first image that could not be used.
std::string first_fault(const FrameReaderCounts& counts) {
  if (counts.skipped.empty()) return {};
  const SkippedImage& first = counts.skipped.front();
  return ", the first: " + printable(first.file) + ": " + first.reason;
}

class FrameLoop {
 public:
  FrameLoop(const RunPlan& plan, LogFile& log_file, ActiveRun& run)
      : plan_(plan), log_file_(log_file), run_(run) {}

  Status open() {
    auto writers = FrameWriters::create(plan_.options);
    if (!writers.ok()) return writers.error();
    writers_ = std::move(*writers);
    if (Status created = create_files(); !created.ok()) return created;
    runner().add_sink(log_frame);
    runner().add_sink([&run = run_](const FrameRecord& record, const TrackResult& result) {
      run.files->add(record, result.retracked);
    });
    return open_view();
  }

  Status run() {
    ProgressBar progress(run_.reader->length(), is_quiet());
    bool first = true;
    while (auto offered = run_.reader->next_offered(stop_token())) {
      const FramePtr& frame = offered->frame;
      if (!frame) {
        miss(*offered);
        if (is_interrupted()) break;
        continue;
      }
      if (std::exchange(first, false))
        if (Status begun = begin(*frame); !begun.ok()) return begun;
      if (run_.view)
        if (Status due = await_turn(*frame, progress); !due.ok()) return due;
      if (run_.stopped) break;
      const TrackState state = step(frame);
      progress.update(index(frame->id) + 1, to_string(state));
      if (is_interrupted()) break;
    }
    return Ok{};
  }

  Status finish() {
    run_.interrupted_by = StopSignal::received();
    run_.stopped = stop_token().stop_requested();
    const SlamOutcome& outcome = finish_runner();
    run_.interrupted_by = StopSignal::received();
    const Status pictures = writers_.finish();
    if (outcome.statistics.frames == 0 && !run_.interrupted_by && !run_.stopped)
      return Error{ErrorKind::kInput, plan_.options.sequence + ": not one frame could be read" +
                                          first_fault(run_.reader->counts())};
    if (recorder_ && recorded_.ok()) recorded_ = finish_recording();
    return pictures.ok() ? recorded_ : pictures;
  }

 private:
  /// A signal that ended the frames leaves the map its last adjustments; one that comes now does
  /// not.
  const SlamOutcome& finish_runner() {
    const trace::Span span("end of the run");
    return runner().finish_unless(run_.interrupted_by ? nullptr : &StopSignal::flag());
  }
  Status finish_recording() {
    if (Status finished = recorder_->finish(runner()); !finished.ok()) return finished;
    std::error_code code;
    if (std::filesystem::exists(plan_.options.mcap, code)) return Ok{};
    return Error{ErrorKind::kOutput, plan_.options.mcap + ": was removed during the run"};
  }
  [[nodiscard]] Runner& runner() { return *run_.session.runner; }
  [[nodiscard]] std::stop_token stop_token() const {
    return run_.view ? run_.view->stop_token() : std::stop_token();
  }

  /// The run's own files, empty.
  Status create_files() {
    const RunOptions& o = plan_.options;
    auto files = FrameFiles::create(o.out_dir, plan_.sequence.stamp_decimals, !o.deterministic,
                                    o.covariance);
    if (!files.ok()) return files.error();
    run_.files = std::move(*files);
    return Ok{};
  }

  Status open_view() {
    const RunOptions& o = plan_.options;
    if (!o.view.address) return Ok{};
    auto started = start_page(o.view, {.camera = plan_.sequence.camera,
                                       .paced = o.realtime,
                                       .map = o.save_map.empty() ? RunViewConfig::Map::kResets
                                                                 : RunViewConfig::Map::kSaves});
    if (!started.ok()) return started.error();
    run_.view = std::move(started).value();
    return Ok{};
  }

  /// What is not opened before there is a frame: a call that ends in an error leaves no empty map,
  /// and an earlier run's files alone.
  Status begin(const RgbdFrame& frame) {
    if (Status opened = open_map_saver(); !opened.ok()) return opened;
    if (!plan_.options.mcap.empty()) {
      auto created = RunRecorder::create(plan_.options.mcap, plan_.sequence.camera);
      if (!created.ok()) return created.error();
      recorder_ = std::move(created).value();
    }
    if (run_.trace)
      if (Status started = run_.trace->start(plan_.options.trace); !started.ok()) return started;
    if (Status placed = log_file_.place(); !placed.ok()) return placed;
    warn_about_depth(frame);
    return Ok{};
  }

  Status open_map_saver() {
    const std::filesystem::path file = plan_.options.save_map;
    if (file.empty()) return Ok{};
    const OrbConfig& orb = plan_.settings().orb;
    const bool is_replaced = replaces_map(plan_.options);
    if (is_replaced)
      if (const auto info = read_map_info(file); info.ok())
        run_.replaced_map = parse_identity(info->uuid);
    auto saver =
        MapSaver::open(file, Camera(plan_.sequence.camera), {orb.levels, orb.scale_factor});
    if (!saver.ok()) return saver.error();
    run_.map_saver = std::move(saver).value();
    if (!is_replaced) return Ok{};
    log::warn("{}: the map in it is replaced; --load-map would go on with it", file.string());
    // The dense map of the one that was there goes with it; the new one may have none.
    std::error_code code;
    const auto dense = dense_file_of(file);
    if (!plan_.dense_file() && run_.replaced_map && is_dense_of(dense, {{*run_.replaced_map}}))
      std::filesystem::remove(dense, code);
    return Ok{};
  }

  /// Does what those who drive wish until the frame is due, or the run is stopped or interrupted.
  Status await_turn(const RgbdFrame& frame, ProgressBar& progress) {
    for (;;) {
      if (run_.view->is_paused()) progress.update(index(frame.id), "paused on the page");
      run_.reader->pause();  // what the page waits makes no frame late
      const auto wishes = run_.view->wait_turn(frame.stamp, &runner(), is_interrupted);
      if (!run_.view->is_paused()) run_.reader->resume();  // else it is a step
      if (wishes.save && run_.map_saver) run_.map_saver->save(runner().map());
      if (wishes.reset)
        if (Status begun = begin_anew(); !begun.ok()) return begun;
      run_.stopped = wishes.stop;
      if (wishes.stop || wishes.go || is_interrupted()) return Ok{};
    }
  }

  /// Forgets all that was, in the run's files too.
  Status begin_anew() {
    runner().reset();
    if (Status created = create_files(); !created.ok()) return created;
    log::info("begun anew, as the live page asked");
    run_.view->restart();
    return Ok{};
  }

  void miss(const OfferedFrame& missed) {
    run_.files->add_missed(missed);
    if (missed.while_paused) return;
    runner().miss(missed.stamp);
    if (run_.view) run_.view->miss();
  }

  TrackState step(const FramePtr& frame) {
    const trace::Span span("frame", frame->id);
    if (plan_.sequence.stream) {
      add_streamed(frame->id);
    } else {
      add_motion_until(frame->stamp);
    }
    const TrackResult result = runner().process(frame);
    writers_.add(frame, result);
    if (run_.view) {
      run_.view->show(frame, result);
      run_.view->show_map(runner());
    }
    if (recorder_ && recorded_.ok()) recorded_ = recorder_->add(*frame, result, runner());
    return result.state;
  }

  /// As they would have come: an image takes longer to arrive than what was measured meanwhile.
  void add_motion_until(Timestamp stamp) {
    const auto& [imu, wheels] = std::tie(plan_.settings().imu, plan_.settings().wheels);
    add_until(stamp, imu ? imu->time_offset_s.value_or(0) : 0, plan_.imu, next_imu_);
    add_until(stamp, wheels ? wheels->time_offset_s : 0, plan_.wheels, next_wheels_);
  }
  void add_streamed(FrameId id) {
    const StreamMotion motion = plan_.sequence.stream->take_motion(id);
    for (const ImuSample& reading : motion.imu) runner().add(reading);
    for (const OdometrySample& pose : motion.wheels) runner().add(pose);
  }
  template <typename Sample>
  void add_until(Timestamp stamp, double offset_s, const std::vector<Sample>& samples,
                 std::size_t& next) {
    constexpr double kLead_s = 0.02;
    while (next < samples.size() &&
           seconds_between(samples[next].stamp, stamp) <= kLead_s + offset_s)
      runner().add(samples[next++]);
  }

  const RunPlan& plan_;
  std::size_t next_imu_ = 0, next_wheels_ = 0;
  LogFile& log_file_;
  ActiveRun& run_;
  FrameWriters writers_;
  std::optional<RunRecorder> recorder_;
  Status recorded_ = Ok{};
};

}  // namespace

Status open_run(const RunPlan& plan, ActiveRun& run) {
  SessionOptions session = plan.session;
  if (!plan.options.save_map.empty())
    session.map_sink = [&run](const Map& map) { run.map_saver->look(map); };
  auto opened = open_session(std::move(session));
  if (!opened.ok()) return opened.error();
  run.session = std::move(opened).value();
  return Ok{};
}

Status process_frames(const RunPlan& plan, LogFile& log_file, ActiveRun& run) {
  run.reader = std::make_unique<FrameReader>(plan.sequence, plan.reading);
  FrameLoop loop(plan, log_file, run);
  if (Status opened = loop.open(); !opened.ok()) return opened;
  if (Status ran = loop.run(); !ran.ok()) return ran;
  return loop.finish();
}

}  // namespace ygslam
