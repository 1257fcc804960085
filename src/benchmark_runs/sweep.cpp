#include "benchmark_runs/sweep.hpp"

#include <algorithm>
#include <csignal>

#include "benchmark_runs/dask_engine.hpp"
#include "benchmark_runs/earlier_runs.hpp"
#include "benchmark_runs/judge_run.hpp"
#include "benchmark_runs/run_files.hpp"
#include "benchmark_runs/sweep_file.hpp"
#include "core/utc_time.hpp"
#include "io/inner_folder.hpp"
#include "io/json_text.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr int kWaitAtMost_ms = 200;  // between two looks at the stop request

}  // namespace

Sweep::Sweep(SweepOptions options, SweepObserver observer, OutputLock lock)
    : options_(std::move(options)),
      comparable_(comparable_options(options_)),
      observer_(std::move(observer)),
      lock_(std::move(lock)),
      started_(utc_time_now()) {}

Result<Sweep> Sweep::open(SweepOptions options, SweepObserver observer) {
  const auto found = find_sequences(options.root);
  if (!found.ok()) return found.error();
  auto chosen = select_sequences(*found, options.sequences);
  if (!chosen.ok()) return chosen.error();
  const Status writable = ensure_writable_directory(options.out);
  if (!writable.ok()) return writable.error();
  auto lock = OutputLock::acquire(options.out);
  if (!lock.ok()) return lock.error();
  Sweep sweep(std::move(options), std::move(observer), std::move(*lock));
  sweep.sequences_ = std::move(*chosen);
  for (BenchSequence& sequence : sweep.sequences_) sweep.look_at(sequence);
  const Status checked = sweep.check_earlier();
  if (!checked.ok()) return checked.error();
  if (!sweep.options_.engine.empty()) {
    const auto slots = engine_slots(sweep.options_, sweep.sequences_, sweep.observer_.stop);
    if (!slots.ok()) return slots.error();
    if (sweep.options_.jobs == 0) sweep.options_.jobs = *slots;
  }
  std::vector<RunKey> planned = planned_runs(sweep.options_, sweep.sequences_);
  sweep.total_ = planned.size();
  std::erase_if(planned,
                [&](const RunKey& key) { return sweep.finished_.contains(key.folder().string()); });
  sweep.waiting_.assign(planned.rbegin(), planned.rend());
  return sweep;
}

void Sweep::look_at(BenchSequence& sequence) const {
  inspect_sequence(sequence);
  if (const auto masks = masks_folder(options_, sequence); masks && any_uses_masks(options_.modes))
    sequence.masks_fingerprint = fingerprint_of_masks(*masks);
}

void Sweep::tell_faults() const {
  for (const BenchSequence& sequence : sequences_) {
    if (sequence.error) observer_.on_fault(sequence.name + ": " + *sequence.error);
  }
  for (const std::string& line : repeated_) observer_.on_fault(line);
}

// Results of an earlier call: the same make, or nothing is touched.
Status Sweep::check_earlier() {
  const fs::path file = options_.out / "sweep.json";
  std::error_code code;
  if (fs::exists(file, code)) {
    auto earlier = read_sweep_file(file);
    if (!earlier.ok()) return not_ours(earlier.error().message);
    if (const auto other =
            other_make(earlier->version, earlier->options, options_.version, comparable_)) {
      return of_other_make(file, *other);
    }
    started_ = earlier->started;
    earlier_wall_s_ = earlier->wall_s;
    earlier_ = std::move(earlier->json);
  }
  for (BenchSequence& sequence : sequences_) {
    Status checked = check_runs_of(sequence);
    if (!checked.ok()) return checked;
  }
  // Sequences that are not asked for now: only whether their runs are all there.
  for (const RunKey& key : asked_runs(earlier_)) {
    if (is_selected(key.sequence_id)) continue;
    const auto record = read_run_record(options_.out / key.folder() / "run.json");
    if (record.ok() && is_final(*record, 0) &&
        !fault_of_files(options_.out / key.folder(), *record)) {
      finished_[key.folder().string()] = *record;
    }
  }
  return Ok{};
}

bool Sweep::is_selected(const std::string& id) const {
  return std::any_of(sequences_.begin(), sequences_.end(),
                     [&](const BenchSequence& sequence) { return sequence.id == id; });
}

Status Sweep::check_runs_of(BenchSequence& sequence) {
  auto earlier = read_earlier_runs(options_, comparable_, sequence);
  if (!earlier.ok()) return earlier.error();
  if (earlier->changed) sequence.error = earlier->changed;
  finished_.merge(earlier->done);
  if (sequence.error) return Ok{};  // nothing is made again of what cannot be used
  repeated_.insert(repeated_.end(), earlier->repeated.begin(), earlier->repeated.end());
  return Ok{};
}

Status Sweep::copy_truths() const {
  for (const BenchSequence& sequence : sequences_) {
    if (sequence.error || !sequence.groundtruth) continue;
    const auto text = read_file(*sequence.groundtruth);
    if (!text.ok()) continue;  // the runs will say so
    const fs::path folder = options_.out / "sequences" / sequence.id;
    if (Status made = make_inner_folder(options_.out, fs::path("sequences") / sequence.id);
        !made.ok())
      return made;
    Status written = write_file_atomically(folder / "groundtruth.txt", *text);
    if (!written.ok()) return written;
  }
  return Ok{};
}

Status Sweep::write_sweep_file() const {
  SweepFacts facts;
  facts.started = started_;
  facts.wall_s = wall_s();
  // Runs of earlier calls that are not looked at now may have spoiled timings, too.
  facts.timings_valid = (!earlier_.is_object() || earlier_.value("timings_valid", true)) &&
                        std::all_of(finished_.begin(), finished_.end(),
                                    [](const auto& entry) { return entry.second.timings_valid; });
  auto json = sweep_json(options_, comparable_, sequences_, facts, earlier_);
  const std::vector<RunKey> asked = asked_runs(json);
  json["complete"] = std::all_of(asked.begin(), asked.end(), [&](const RunKey& key) {
    return finished_.contains(key.folder().string());
  });
  const std::string text = json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  return write_file_atomically(options_.out / "sweep.json", text + "\n");
}

Result<bool> Sweep::run() {
  Status begun = copy_truths();
  if (begun.ok()) begun = write_sweep_file();
  if (!begun.ok()) return begun.error();
  const auto result = work();
  end_all(children_, options_.patience_s);
  active_.clear();
  const Status written = write_sweep_file();
  if (!result.ok()) return result.error();
  if (!written.ok()) return written.error();
  return *result;
}

Result<bool> Sweep::work() {
  while (!waiting_.empty() || !active_.empty()) {
    if (observer_.stop()) return false;
    while (!waiting_.empty() && active_.size() < static_cast<std::size_t>(options_.jobs)) {
      const RunKey key = waiting_.back();
      waiting_.pop_back();
      const Status started = start(key);
      if (!started.ok()) return started.error();
    }
    observer_.on_progress(total_ - waiting_.size() - active_.size(), total_,
                          sequence_of(active_.front().key).name + " " + active_.front().key.mode);
    int ended = wait_for_any(children_, kWaitAtMost_ms);
    if (ended < 0) ended = end_late_ones();
    if (ended < 0) continue;
    if (observer_.stop()) return false;  // the same signal may have ended it
    const Status done = finish(static_cast<std::size_t>(ended));
    if (!done.ok()) return done.error();
  }
  observer_.on_progress(total_, total_, "");
  return true;
}

// Asks those whose time is over to end, then makes them. @return one that was made to, or -1.
int Sweep::end_late_ones() {
  if (!options_.engine.empty()) return -1;  // there the worker looks at the clock
  for (std::size_t i = 0; i < active_.size(); ++i) {
    Active& run = active_[i];
    if (run.limit_s == 0 || children_[i].age_s() < run.limit_s) continue;
    if (!run.timed_out) children_[i].send(SIGTERM);
    run.timed_out = true;
    if (children_[i].age_s() < run.limit_s + options_.patience_s) continue;
    children_[i].send(SIGKILL);
    return static_cast<int>(i);
  }
  return -1;
}

Status Sweep::start(const RunKey& key) {
  const BenchSequence& sequence = sequence_of(key);
  const fs::path folder = options_.out / key.folder();
  if (Status checked = check_inner_folder(options_.out, key.folder()); !checked.ok())
    return checked;
  std::error_code code;
  fs::remove_all(folder, code);  // what a broken-off run left
  if (!code) fs::create_directories(folder, code);
  if (code) return Error{ErrorKind::kOutput, folder.string() + ": " + code.message()};
  auto command = run_command(options_, sequence, key);
  const double limit_s = run_limit_s(options_, sequence);
  if (!options_.engine.empty()) {
    auto handing = engine_command(options_, folder, limit_s, command);
    if (!handing.ok()) return handing.error();
    command = std::move(*handing);
  }
  auto child = ChildProcess::start(command);
  if (!child.ok()) return child.error();
  children_.push_back(std::move(*child));
  active_.push_back({key, &sequence, limit_s, false});
  return Ok{};
}

Status Sweep::finish(std::size_t index) {
  const auto at = static_cast<std::ptrdiff_t>(index);
  const Active run = active_[index];
  ChildExit exit = children_[index].finish();
  exit.timed_out = run.timed_out;
  active_.erase(active_.begin() + at);
  children_.erase(children_.begin() + at);
  if (!options_.engine.empty()) {
    auto there = exit_on_worker(exit);
    if (!there.ok()) return there.error();
    exit = std::move(*there);
  }
  exit.limit_s = run.limit_s;
  const fs::path folder = options_.out / run.key.folder();
  auto record = judge_run(options_, *run.sequence, run.key, exit);
  if (!record.ok()) return record.error();
  record->options = options_of_mode(comparable_, run.key.mode);
  const std::string text =
      to_json(*record).dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  Status written = write_file_atomically(folder / "run.json", text + "\n");
  if (!written.ok()) return written;
  if (is_final(*record, run.limit_s)) {
    finished_[run.key.folder().string()] = *record;
  } else {
    ++to_try_again_;
  }
  const bool good = record->status == RunStatus::kOk;
  (good ? observer_.on_line : observer_.on_fault)(describe_run(folder, *run.sequence, *record));
  return write_sweep_file();
}

bool Sweep::has_usable_sequence() const {
  return std::any_of(sequences_.begin(), sequences_.end(),
                     [](const BenchSequence& sequence) { return !sequence.error; });
}

const BenchSequence& Sweep::sequence_of(const RunKey& key) const {
  const auto found = std::find_if(sequences_.begin(), sequences_.end(),
                                  [&](const auto& s) { return s.id == key.sequence_id; });
  CHECK(found != sequences_.end());
  return *found;
}

double Sweep::wall_s() const {
  return earlier_wall_s_ +
         std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

}  // namespace ygslam
