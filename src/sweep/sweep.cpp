#include "sweep/sweep.hpp"

#include <algorithm>

#include "io/json_text.hpp"
#include "io/text.hpp"
#include "sweep/judge_run.hpp"
#include "sweep/sweep_file.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr double kPatience_s = 5;    // a run saves what it has when asked to end
constexpr int kWaitAtMost_ms = 200;  // between two looks at the stop request

std::vector<fs::path> subfolders(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code)) {
    if (at->is_directory(code)) found.push_back(at->path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

Error of_other_make(const fs::path& file, const std::string& what) {
  return {ErrorKind::kOutput,
          file.string() + ": " + what + "; give another --out, or remove the old results"};
}

std::optional<std::string> other_make(const std::string& version, const nlohmann::json& options,
                                      const std::string& version_now,
                                      const nlohmann::json& options_now) {
  if (version != version_now) {
    return "made by version " + printable(version) + ", this is " + version_now;
  }
  if (const auto what = difference(options, options_now))
    return "made with other options: " + *what;
  return std::nullopt;
}

}  // namespace

Sweep::Sweep(SweepOptions options, SweepObserver observer, OutputLock lock)
    : options_(std::move(options)),
      comparable_(comparable_options(options_)),
      observer_(std::move(observer)),
      lock_(std::move(lock)),
      started_(iso_time_now()) {}

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
  for (BenchSequence& sequence : sweep.sequences_) inspect_sequence(sequence);
  const Status checked = sweep.check_earlier();
  if (!checked.ok()) return checked.error();
  const Status copied = sweep.copy_truths();
  if (!copied.ok()) return copied.error();
  for (const BenchSequence& sequence : sweep.sequences_) {
    if (sequence.error) sweep.observer_.on_fault(sequence.name + ": " + *sequence.error);
  }
  std::vector<RunKey> planned = planned_runs(sweep.options_, sweep.sequences_);
  sweep.total_ = planned.size();
  std::erase_if(planned,
                [&](const RunKey& key) { return sweep.finished_.contains(key.folder().string()); });
  sweep.waiting_.assign(planned.rbegin(), planned.rend());
  const Status written = sweep.write_sweep_file(false);
  if (!written.ok()) return written.error();
  return sweep;
}

// Results of an earlier call: the same make, or nothing is touched.
Status Sweep::check_earlier() {
  const fs::path file = options_.out / "sweep.json";
  std::error_code code;
  if (fs::exists(file, code)) {
    auto earlier = read_sweep_file(file);
    if (!earlier.ok()) return earlier.error();
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
  return Ok{};
}

Status Sweep::check_runs_of(BenchSequence& sequence) {
  for (const fs::path& mode : subfolders(options_.out / "runs" / sequence.id)) {
    for (const fs::path& run : subfolders(mode)) {
      const auto record = read_run_record(run / "run.json");
      if (!record.ok()) continue;  // half-written: it will be run anew
      if (const auto other =
              other_make(record->version, record->options, options_.version, comparable_)) {
        return of_other_make(run / "run.json", *other);
      }
      if (!sequence.error && record->sequence_fingerprint != sequence.fingerprint) {
        sequence.error = "its images, camera or truth are not those of the runs in " +
                         (fs::path("runs") / sequence.id).string() +
                         "; remove that folder to run it anew";
      }
      const RunKey key{sequence.id, record->mode, record->run};
      if (options_.out / key.folder() == run) finished_[key.folder().string()] = *record;
    }
  }
  return Ok{};
}

Status Sweep::copy_truths() const {
  for (const BenchSequence& sequence : sequences_) {
    if (sequence.error || !sequence.groundtruth) continue;
    const auto text = read_file(*sequence.groundtruth);
    if (!text.ok()) continue;  // the runs will say so
    const fs::path folder = options_.out / "sequences" / sequence.id;
    std::error_code code;
    fs::create_directories(folder, code);
    Status written = write_file_atomically(folder / "groundtruth.txt", *text);
    if (!written.ok()) return written;
  }
  return Ok{};
}

Status Sweep::write_sweep_file(bool complete) const {
  SweepFacts facts;
  facts.started = started_;
  facts.wall_s = wall_s();
  facts.complete = complete;
  // Runs of earlier calls that are not looked at now may have spoiled timings, too.
  facts.timings_valid = (!earlier_.is_object() || earlier_.value("timings_valid", true)) &&
                        std::all_of(finished_.begin(), finished_.end(),
                                    [](const auto& entry) { return entry.second.timings_valid; });
  const std::string text = sweep_json(options_, comparable_, sequences_, facts, earlier_)
                               .dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  return write_file_atomically(options_.out / "sweep.json", text + "\n");
}

Result<bool> Sweep::run() {
  const auto result = work();
  end_all(children_, kPatience_s);
  active_.clear();
  const Status written = write_sweep_file(result.ok() && *result);
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
    const int ended = wait_for_any(children_, kWaitAtMost_ms);
    if (ended < 0) continue;
    if (observer_.stop()) return false;  // the same signal may have ended it
    const Status done = finish(static_cast<std::size_t>(ended));
    if (!done.ok()) return done.error();
  }
  observer_.on_progress(total_, total_, "");
  return true;
}

Status Sweep::start(const RunKey& key) {
  const BenchSequence& sequence = sequence_of(key);
  const fs::path folder = options_.out / key.folder();
  std::error_code code;
  fs::remove_all(folder, code);  // what a broken-off run left
  if (!code) fs::create_directories(folder, code);
  if (code) return Error{ErrorKind::kOutput, folder.string() + ": " + code.message()};
  auto child = ChildProcess::start(run_command(options_, sequence, key));
  if (!child.ok()) return child.error();
  children_.push_back(std::move(*child));
  active_.push_back({key, &sequence});
  return Ok{};
}

Status Sweep::finish(std::size_t index) {
  const auto at = static_cast<std::ptrdiff_t>(index);
  const Active run = active_[index];
  const ChildExit exit = children_[index].finish();
  active_.erase(active_.begin() + at);
  children_.erase(children_.begin() + at);
  const fs::path folder = options_.out / run.key.folder();
  auto record = judge_run(options_, *run.sequence, run.key, exit);
  if (!record.ok()) return record.error();
  record->options = comparable_;
  const std::string text =
      to_json(*record).dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  Status written = write_file_atomically(folder / "run.json", text + "\n");
  if (!written.ok()) return written;
  finished_[run.key.folder().string()] = *record;
  const bool good = record->status == RunStatus::kOk;
  (good ? observer_.on_line : observer_.on_fault)(describe_run(folder, *run.sequence, *record));
  return write_sweep_file(false);
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
