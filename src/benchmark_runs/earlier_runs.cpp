#include "benchmark_runs/earlier_runs.hpp"

#include <algorithm>

#include "benchmark_runs/run_files.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

std::vector<fs::path> subfolders(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code)) {
    if (at->is_directory(code)) found.push_back(at->path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Why a run has to be made anew, if it has to.
std::optional<std::string> why_again(const fs::path& folder, const RunRecord& record,
                                     double limit_s) {
  if (!is_final(record, limit_s)) {
    return std::string(name_of(record.status)) + ": " + record.error.value_or("") + "; tried again";
  }
  if (auto fault = fault_of_files(folder, record)) return *fault + "; made anew";
  return std::nullopt;
}

// What has changed since the run was made; masks count where this call makes runs with masks.
std::optional<std::string> change_since(const SweepOptions& options, const BenchSequence& sequence,
                                        const RunRecord& record) {
  const auto told = [](const std::string& what, const fs::path& folder) {
    return what + " not those of the runs in " + folder.string() +
           "; remove that folder to run it anew";
  };
  const fs::path runs = fs::path("runs") / sequence.id;
  if (record.sequence_fingerprint != sequence.fingerprint) {
    return told("its images, camera or truth are", runs);
  }
  if (any_uses_masks(options.modes) && mode_uses_masks(record.mode) &&
      record.masks_fingerprint != sequence.masks_fingerprint) {
    return told("its masks are", runs / record.mode);
  }
  return std::nullopt;
}

}  // namespace

Error not_ours(const std::string& what) {
  return {ErrorKind::kOutput, what + "; give another --out, or remove the old results"};
}

Error of_other_make(const fs::path& file, const std::string& what) {
  return not_ours(file.string() + ": " + what);
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

Result<EarlierRuns> read_earlier_runs(const SweepOptions& options, const nlohmann::json& comparable,
                                      const BenchSequence& sequence) {
  EarlierRuns earlier;
  for (const fs::path& mode : subfolders(options.out / "runs" / sequence.id)) {
    for (const fs::path& run : subfolders(mode)) {
      const auto record = read_run_record(run / "run.json");
      if (!record.ok()) continue;  // half-written: it never came to its end
      const RunKey key{sequence.id, record->mode, record->run};
      if (options.out / key.folder() != run) continue;  // somebody has moved it
      if (const auto other =
              other_make(record->version, options_of_mode(record->options, record->mode),
                         options.version, options_of_mode(comparable, record->mode))) {
        return of_other_make(run / "run.json", *other);
      }
      if (!sequence.error && !earlier.changed) {
        earlier.changed = change_since(options, sequence, *record);
      }
      if (const auto why = why_again(run, *record, run_limit_s(options, sequence))) {
        earlier.repeated.push_back(key.folder().string() + ": " + *why);
      } else {
        earlier.done[key.folder().string()] = *record;
      }
    }
  }
  return earlier;
}

}  // namespace ygslam
