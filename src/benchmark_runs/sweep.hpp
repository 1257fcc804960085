// Every sequence in every mode, several times, each run in a process of its own; what is done is
// not done again.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "benchmark_runs/child_process.hpp"
#include "benchmark_runs/sweep_options.hpp"
#include "io/atomic_file.hpp"

namespace ygslam {

/// What the sweep tells while it goes on, and how it is stopped.
struct SweepObserver {
  std::function<void(const std::string&)> on_line;   ///< a finished run, one line
  std::function<void(const std::string&)> on_fault;  ///< something unusable, one line
  std::function<void(std::size_t done, std::size_t total, const std::string& now)> on_progress;
  std::function<bool()> stop;  ///< asked a few times a second
};

class Sweep {
 public:
  /// Finds the sequences and looks at what the results folder holds already; writes nothing there.
  /// @return kUsage: no such sequence name; kInput: nothing to be found; kOutput: the folder cannot
  /// be written, is in use, or holds results of another version or of other options (named), or the
  /// engine cannot be used.
  static Result<Sweep> open(SweepOptions options, SweepObserver observer);

  /// Writes sweep.json and does what is left to do. @return true if all is done, false if it was
  /// stopped (nothing is lost then); kOutput if a result cannot be written or the engine is gone.
  Result<bool> run();

  /// Tells of the sequences that cannot be used and of the earlier runs that are made again.
  void tell_faults() const;
  [[nodiscard]] const std::vector<BenchSequence>& sequences() const { return sequences_; }
  /// Whether at least one sequence can be used.
  [[nodiscard]] bool has_usable_sequence() const;
  [[nodiscard]] std::size_t total() const { return total_; }
  [[nodiscard]] std::size_t done_before() const { return total_ - waiting_.size(); }
  /// Runs of this call that were ended from outside: the next call makes them again.
  [[nodiscard]] std::size_t to_try_again() const { return to_try_again_; }

 private:
  struct Active {
    RunKey key;
    const BenchSequence* sequence;
    double limit_s;  ///< 0: none
    bool timed_out;
  };
  Sweep(SweepOptions options, SweepObserver observer, OutputLock lock);

  void look_at(BenchSequence& sequence) const;
  Status check_earlier();
  [[nodiscard]] bool is_selected(const std::string& id) const;
  Status check_runs_of(BenchSequence& sequence);
  [[nodiscard]] Status write_sweep_file() const;
  Status copy_truths() const;
  Result<bool> work();
  int end_late_ones();
  Status start(const RunKey& key);
  Status finish(std::size_t index);
  [[nodiscard]] const BenchSequence& sequence_of(const RunKey& key) const;
  [[nodiscard]] double wall_s() const;

  SweepOptions options_;
  nlohmann::json comparable_;
  SweepObserver observer_;
  OutputLock lock_;
  std::vector<BenchSequence> sequences_;
  std::map<std::string, RunRecord> finished_;  ///< by the run's folder
  std::vector<std::string> repeated_;          ///< earlier runs that are made again, and why
  nlohmann::json earlier_;                     ///< sweep.json as found, or null
  std::vector<RunKey> waiting_;                ///< the next one last
  std::size_t total_ = 0;
  std::size_t to_try_again_ = 0;
  std::vector<Active> active_;
  std::vector<ChildProcess> children_;  ///< beside active_
  std::string started_;
  double earlier_wall_s_ = 0;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace ygslam
