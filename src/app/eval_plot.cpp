#include "app/eval_plot.hpp"

#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "benchmark_runs/python_tool.hpp"
#include "io/atomic_file.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::json;

// A file that goes with the object.
class TemporaryFile {
 public:
  static Result<TemporaryFile> create(std::string_view content) {
    std::error_code code;
    std::string name = (fs::temp_directory_path(code) / "ygslam-plot.XXXXXX").string();
    const int descriptor = code ? -1 : ::mkstemp(name.data());
    if (descriptor < 0) return Error{ErrorKind::kOutput, name + ": cannot be written"};
    ::close(descriptor);
    TemporaryFile file(name);
    Status written = write_file_atomically(file.path_, content);
    if (!written.ok()) return written.error();
    return file;
  }
  TemporaryFile(TemporaryFile&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  TemporaryFile& operator=(TemporaryFile&&) = delete;
  ~TemporaryFile() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove(path_, ignored);
  }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  explicit TemporaryFile(fs::path path) : path_(std::move(path)) {}
  fs::path path_;
};

// Times count from the truth's first pose: seconds, or poses where there are no stamps.
Json path_json(std::span<const StampedPose> poses, Timestamp start, bool has_stamps) {
  Json times = Json::array();
  Json positions = Json::array();
  for (const StampedPose& pose : poses) {
    const Vec3& t = pose.T_world_camera.t();
    times.push_back(has_stamps ? seconds_between(pose.stamp, start)
                               : static_cast<double>(pose.stamp.ns));
    positions.push_back({t.x(), t.y(), t.z()});
  }
  return {{"t", times}, {"xyz", positions}};
}

std::string plot_data(std::span<const StampedPose> truth,
                      std::span<const PlottedEstimate> estimates) {
  const Timestamp start = truth.front().stamp;
  const bool has_stamps = estimates.front().evaluation->report.options.has_stamps;
  Json data = {{"time", has_stamps ? "time [s]" : "pose"},
               {"truth", path_json(truth, start, has_stamps)},
               {"alignment", name_of(estimates.front().evaluation->report.options.align)},
               {"estimates", Json::array()}};
  for (const auto& [name, evaluation] : estimates) {
    Json entry = path_json(evaluation->series.pairs.estimate, start, has_stamps);
    entry["name"] = name;
    entry["ate_m"] = evaluation->series.absolute.trans_m;
    entry["rmse_m"] = evaluation->report.ate_m.rmse;
    entry["truth_xyz"] = path_json(evaluation->series.pairs.truth, start, has_stamps)["xyz"];
    data["estimates"].push_back(std::move(entry));
  }
  return data.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

bool is_plot_file(const fs::path& file) {
  const std::string kind = file.extension().string();
  return kind == ".svg" || kind == ".png" || kind == ".pdf";
}

Status write_plot(const fs::path& file, std::span<const StampedPose> truth,
                  std::span<const PlottedEstimate> estimates) {
  CHECK(!truth.empty() && !estimates.empty());
  const auto tool = find_report_tool(executable_path(), "eval_plot.py");
  if (!tool.ok()) return tool.error();
  const auto data = TemporaryFile::create(plot_data(truth, estimates));
  if (!data.ok()) return data.error();
  return run_tool(*tool, {"--out=" + file.string()}, file.string(), data->path());
}

}  // namespace ygslam
