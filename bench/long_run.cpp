// long_run SEQUENCE [--frames N] [--segmenter masks:DIR] [--live] ...; --help tells all.
//
// Plays a recording forwards and backwards again and again, as one endless walk over the same
// ground, and tells every thousand frames what the run holds and what a frame costs. Nothing but
// the map may grow with time, and the map only with the ground.
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "core/statistics.hpp"
#include "io/frame_loader.hpp"
#include "io/trajectory_formats.hpp"
#include "io/tum_sequence.hpp"
#include "segment/recorded_masks.hpp"
#include "system/runner.hpp"

namespace ygslam::bench {
namespace {

constexpr double kTruthWithin_s = 0.02;

struct Options {
  std::string sequence, segmenter = "none";
  std::vector<std::string> sets;
  std::size_t frames = 3000, every = 1000;
  std::uint64_t seed = 0;
  double max_growth_percent = 2;
  bool live = false;
};

/// What is played: decoded once, so that the run alone costs time.
struct Recording {
  std::optional<Camera> camera;
  std::vector<RgbdFrame> frames;
  std::vector<std::optional<Segmentation>> masks;  ///< beside the frames; empty without a segmenter
  std::vector<std::optional<Vec3>> positions;      ///< true ones, in the first frame's camera
  double interval_s = 0;                           ///< median, between frames

  /// The frame at a step of the way there and back, without resting at the ends.
  [[nodiscard]] std::size_t at(std::size_t step) const {
    const std::size_t there_and_back = 2 * (frames.size() - 1);
    const std::size_t place = step % there_and_back;
    return std::min(place, there_and_back - place);
  }
  [[nodiscard]] double megabytes() const {
    double bytes = 0;
    for (const RgbdFrame& f : frames)
      bytes += static_cast<double>(f.grey.size()) * (sizeof(Rgb8) + 1 + sizeof(float));
    for (const auto& m : masks) bytes += m ? static_cast<double>(m->ids.size()) : 0;
    return bytes / 1e6;
  }
};

class PlayedMasks final : public Segmenter {
 public:
  explicit PlayedMasks(const Recording& recording) : recording_(recording) {}
  [[nodiscard]] Result<Segmentation> segment(const RgbdFrame& frame) override {
    const auto& masks = recording_.masks[recording_.at(index(frame.id))];
    if (!masks) return Error{ErrorKind::kInput, "the recording has no mask for this frame"};
    Segmentation played = *masks;
    played.frame = frame.id;
    played.stamp = frame.stamp;
    return played;
  }
  [[nodiscard]] std::string precision() const override { return "recorded"; }

 private:
  const Recording& recording_;
};

std::vector<std::optional<Vec3>> true_positions(const Sequence& sequence,
                                                const std::vector<RgbdFrame>& frames) {
  std::vector<std::optional<Vec3>> positions(frames.size());
  if (!sequence.groundtruth) return positions;
  const auto truth = read_tum_trajectory(*sequence.groundtruth);
  if (!truth.ok()) return positions;
  const auto nearest = [&](Timestamp stamp) -> const StampedPose* {
    const auto distance_s = [&](const StampedPose& p) {
      return std::abs(seconds_between(p.stamp, stamp));
    };
    const auto best = std::min_element(
        truth->begin(), truth->end(),
        [&](const auto& a, const auto& b) { return distance_s(a) < distance_s(b); });
    return distance_s(*best) <= kTruthWithin_s ? &*best : nullptr;
  };
  const StampedPose* first = nearest(frames.front().stamp);
  if (!first) return positions;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (const StampedPose* pose = nearest(frames[i].stamp))
      positions[i] = (first->T_world_camera.inverse() * pose->T_world_camera).t();
  return positions;
}

Result<Recording> load(const Options& options) {
  const auto sequence = open_tum_sequence(options.sequence);
  if (!sequence.ok()) return sequence.error();
  std::unique_ptr<Segmenter> segmenter;
  if (options.segmenter != "none") {
    auto opened =
        make_recorded_segmenter(options.segmenter.substr(options.segmenter.find(':') + 1));
    if (!opened.ok()) return opened.error();
    segmenter = std::move(opened).value();
  }
  Recording recording;
  recording.camera.emplace(sequence->camera);
  for (std::size_t i = 0; i < sequence->pairs.size(); ++i) {
    auto frame = load_frame(*sequence, i);
    if (!frame.ok()) return frame.error();
    if (segmenter) {
      auto masks = segmenter->segment(*frame);
      recording.masks.push_back(masks.ok() ? std::optional(std::move(masks).value())
                                           : std::nullopt);
    }
    recording.frames.push_back(std::move(frame).value());
  }
  if (recording.frames.size() < 2)
    return Error{ErrorKind::kInput, options.sequence + ": fewer than two frames"};
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < recording.frames.size(); ++i)
    intervals_s.push_back(
        seconds_between(recording.frames[i].stamp, recording.frames[i - 1].stamp));
  recording.interval_s = median(intervals_s);
  recording.positions = true_positions(*sequence, recording.frames);
  return recording;
}

Result<SlamConfig> settings(const Options& options) {
  SlamConfig config;
  config.dynamic.mode = options.segmenter == "none" ? DynamicMode::kGeometry : DynamicMode::kFull;
  ConfigSchema schema = schema_of(config);
  ConfigFaults faults;
  for (const std::string& set : options.sets) {
    const auto equals = std::min(set.find('='), set.size());
    const std::string value = equals < set.size() ? set.substr(equals + 1) : "";
    faults.add(schema.set(set.substr(0, equals), value, "--set"));
  }
  faults.add(validate(config));
  if (const Status status = faults.status(); !status.ok()) return status.error();
  config.run.seed = options.seed;
  config.run.keep_trajectory = false;
  return resolved(config);
}

Result<std::unique_ptr<Runner>> open_runner(const Options& options, const Recording& recording) {
  const auto config = settings(options);
  if (!config.ok()) return config.error();
  auto segmenter = recording.masks.empty() ? nullptr : std::make_unique<PlayedMasks>(recording);
  const auto make = options.live ? make_live_runner : make_offline_runner;
  return make(*config, *recording.camera, std::move(segmenter), {});
}

double process_cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

/// Resident memory of the process, after free pages went back to the system.
double resident_megabytes() {
  malloc_trim(0);
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmRSS:")) return std::stod(line.substr(6)) * 1024 / 1e6;
  return 0;
}

/// A stretch of the run.
struct Stretch {
  double memory_mb = 0;     ///< resident at its end, without the recording
  double heap_mb = 0;       ///< of it, what the program asked for and has not given back
  double track_cpu_ms = 0;  ///< median of a frame, tracking thread
  double other_cpu_ms = 0;  ///< everything else in the process, a frame
  double cpu_ms = 0;        ///< the whole process, a frame
};

class LongRun {
 public:
  LongRun(const Options& options, const Recording& recording, Runner& runner)
      : options_(options), recording_(recording), runner_(runner) {
    runner_.add_sink([this](const FrameRecord& record, const TrackResult& result) {
      track_cpu_ms_.push_back(record.track_cpu_ms);
      tracked_ += record.has_pose() ? 1 : 0;
      keyframes_made_ += result.candidate ? 1 : 0;
      const auto& truth = recording_.positions[recording_.at(index(record.frame))];
      if (truth && record.has_pose())
        errors_m_.push_back((record.T_world_camera_live.t() - *truth).norm());
    });
  }

  std::vector<Stretch> play() {
    std::printf("%9s %9s %9s %9s %9s %5s %9s %9s %9s %8s\n", "frames", "memory MB", "heap MB",
                "keyframes", "landmarks", "made", "track ms", "other ms", "tracked %", "error m");
    std::fflush(stdout);
    std::vector<Stretch> stretches;
    double cpu_ms = process_cpu_ms();
    for (std::size_t step = 0; step < options_.frames; ++step) {
      runner_.process(frame(step));
      if ((step + 1) % options_.every != 0) continue;
      stretches.push_back(close(process_cpu_ms() - cpu_ms, step + 1));
      cpu_ms = process_cpu_ms();
    }
    return stretches;
  }

 private:
  [[nodiscard]] FramePtr frame(std::size_t step) const {
    auto played = std::make_shared<RgbdFrame>(recording_.frames[recording_.at(step)]);
    played->id = FrameId{static_cast<std::uint32_t>(step)};
    played->stamp = {recording_.frames.front().stamp.ns +
                     to_ns(static_cast<double>(step) * recording_.interval_s)};
    return played;
  }

  Stretch close(double cpu_ms, std::size_t frames) {
    const auto n = static_cast<double>(track_cpu_ms_.size());
    Stretch s;
    s.cpu_ms = cpu_ms / n;
    double tracking_ms = 0;
    for (const double ms : track_cpu_ms_) tracking_ms += ms;
    s.other_cpu_ms = (cpu_ms - tracking_ms) / n;
    s.track_cpu_ms = median(track_cpu_ms_);
    s.memory_mb = resident_megabytes() - recording_.megabytes();
    const auto heap = mallinfo2();
    s.heap_mb = static_cast<double>(heap.uordblks + heap.hblkhd) / 1e6 - recording_.megabytes();
    const Map map = runner_.map();
    std::printf("%9zu %9.1f %9.1f %9zu %9zu %5d %9.2f %9.2f %9.2f", frames, s.memory_mb, s.heap_mb,
                map.keyframes().size(), map.landmark_count(), keyframes_made_, s.track_cpu_ms,
                s.other_cpu_ms, 100 * tracked_ / n);
    if (!errors_m_.empty()) std::printf(" %8.4f", median(errors_m_));
    std::printf("\n");
    std::fflush(stdout);
    track_cpu_ms_.clear();
    errors_m_.clear();
    tracked_ = keyframes_made_ = 0;
    return s;
  }

  const Options& options_;
  const Recording& recording_;
  Runner& runner_;
  std::vector<double> track_cpu_ms_, errors_m_;  // of this stretch
  int tracked_ = 0, keyframes_made_ = 0;
};

/// Mean of one figure over the stretches in [from, to), as shares of the run.
double mean(const std::vector<Stretch>& run, double Stretch::*figure, double from, double to) {
  const auto n = static_cast<double>(run.size());
  const auto first = static_cast<std::size_t>(from * n);
  const std::size_t last = std::max(first + 1, static_cast<std::size_t>(to * n));
  double sum = 0;
  for (std::size_t i = first; i < last; ++i) sum += run[i].*figure;
  return sum / static_cast<double>(last - first);
}

/// How much the straight line through a figure of the last half rises over it [%]: the keyframes
/// of a place come and go by a few, and each holds a megabyte.
double growth_percent(const std::vector<Stretch>& run, double Stretch::*figure) {
  const std::size_t first = run.size() / 2;
  const auto n = static_cast<double>(run.size() - first);
  const double middle = 0.5 * (n - 1);
  const double level = mean(run, figure, 0.5, 1);
  double above = 0, squares = 0;
  for (std::size_t i = first; i < run.size(); ++i) {
    const double x = static_cast<double>(i - first) - middle;
    above += x * (run[i].*figure - level);
    squares += x * x;
  }
  const double slope = above / squares;
  return 100 * slope * n / (level - slope * 0.5 * n);
}

/// @return true if memory grew no more than allowed.
bool judge(const std::vector<Stretch>& run, double max_growth_percent) {
  const double memory = growth_percent(run, &Stretch::memory_mb);
  const double heap = growth_percent(run, &Stretch::heap_mb);
  const auto ratio = [&](double Stretch::*figure) {
    return mean(run, figure, 0.9, 1) / mean(run, figure, 0.1, 0.2);
  };
  std::printf("growth over the last half: memory %+.2f %%, heap %+.2f %% (at most %.2f %%)\n",
              memory, heap, max_growth_percent);
  std::printf("CPU time of a frame, last tenth to second tenth: tracking %.3f, all %.3f\n",
              ratio(&Stretch::track_cpu_ms), ratio(&Stretch::cpu_ms));
  return memory <= max_growth_percent && heap <= max_growth_percent;
}

int fail(const Error& error) {
  std::fprintf(stderr, "error: %s\n", error.message.c_str());
  return static_cast<int>(error.kind);
}

int run(const Options& options) {
  const auto recording = load(options);
  if (!recording.ok()) return fail(recording.error());
  const auto runner = open_runner(options, *recording);
  if (!runner.ok()) return fail(runner.error());
  std::printf("%zu frames of %s to and fro, %s runner, %.0f MB of recording not counted\n",
              recording->frames.size(), options.sequence.c_str(),
              options.live ? "live" : "deterministic", recording->megabytes());
  LongRun run(options, *recording, **runner);
  const bool held = judge(run.play(), options.max_growth_percent);
  (*runner)->finish();
  return held ? 0 : 1;
}

void declare(CLI::App& app, Options& o) {
  app.add_option("SEQUENCE", o.sequence, "Folder in TUM RGB-D layout; it is held in memory")
      ->required();
  app.add_option("--frames", o.frames, "Frames to play")
      ->check(CLI::Range(8, 1000000000))
      ->capture_default_str();
  app.add_option("--every", o.every, "Frames from line to line")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--segmenter", o.segmenter, "Where masks come from; none: mode geometry")
      ->type_name("none|masks:DIR")
      ->check([](const std::string& s) {
        return s == "none" || s.starts_with("masks:") ? "" : "write none or masks:DIR";
      })
      ->capture_default_str();
  app.add_flag("--live", o.live,
               "Threads, as fast as they go; else one thread, the same figures each time");
  app.add_option("--seed", o.seed, "Start of all random sequences")->capture_default_str();
  app.add_option("--set", o.sets, "One setting (see `ygslam config`); may be repeated")
      ->type_name("KEY=VALUE");
  app.add_option("--max-growth", o.max_growth_percent,
                 "Exit 1 if memory grows more over the last half [%]")
      ->capture_default_str();
  app.footer(
      "Columns: memory = resident, after malloc_trim, heap = asked for and not given back, both\n"
      "without the recording; keyframes and landmarks in the map; made = keyframes proposed since\n"
      "the last line; track = median thread CPU time of tracking a frame; other = CPU time of the\n"
      "rest (mapping, masks, copying images), a frame; error = median distance of the live\n"
      "position from the truth, both counted from the first frame.\n"
      "Example: long_run walking_xyz --frames 100000 --segmenter masks:walking_xyz/mask");
}

}  // namespace
}  // namespace ygslam::bench

int main(int argc, char** argv) {
  using namespace ygslam::bench;
  Options options;
  CLI::App app("Plays a recording to and fro for long and tells what grows");
  declare(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (options.frames < 4 * options.every)
    options.every = std::max<std::size_t>(1, options.frames / 4);
  return run(options);
}
