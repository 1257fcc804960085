#include "benchmark_runs/run_files.hpp"

#include <array>
#include <cmath>

#include "benchmark_runs/fingerprint.hpp"
#include "io/json_text.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr std::array kFiles = {"metrics.json", "trajectory.txt", "errors.csv"};
// Below these every number is a length, an angle or a time. Null stands for what was not measured,
// but for the ATE, which would not be there at all.
constexpr std::array kFigureTrees = {"ate", "rpe", "timing_ms", "cpu_ms"};

bool is_sensible(const nlohmann::json& value) {
  return value.is_number() && std::isfinite(value.get<double>()) && value.get<double>() >= 0;
}

// The place of the first value that cannot be, e.g. "ate.rmse"; empty if there is none.
std::string fault_in(const nlohmann::json& tree, const std::string& place) {
  if (tree.is_null()) return "";
  if (!tree.is_object()) return is_sensible(tree) ? "" : place;
  for (const auto& [key, value] : tree.items()) {
    if (auto inner = fault_in(value, place + "." + key); !inner.empty()) return inner;
  }
  return "";
}

std::string fault_of_metrics(const nlohmann::json& metrics) {
  if (!metrics.is_object()) return "not a JSON object";
  const auto coverage = metrics.find("coverage");
  if (coverage == metrics.end() || !is_sensible(*coverage) || coverage->get<double>() > 1) {
    return "coverage is no share";
  }
  const auto no_number = [](const std::string& place) { return place + " is no sensible number"; };
  for (const char* key : kFigureTrees) {
    if (!metrics.contains(key)) continue;
    if (!metrics[key].is_object()) return no_number(key);
    if (auto place = fault_in(metrics[key], key); !place.empty()) return no_number(place);
  }
  if (metrics.contains("ate") && !is_sensible(metrics["ate"].value("rmse", nlohmann::json()))) {
    return no_number("ate.rmse");
  }
  return "";
}

}  // namespace

Result<nlohmann::json> read_metrics(const fs::path& file) {
  auto metrics = read_json(file);
  if (!metrics.ok()) return metrics;
  if (const auto fault = fault_of_metrics(*metrics); !fault.empty()) {
    return Error{ErrorKind::kInput, file.string() + ": " + printable(fault)};
  }
  return metrics;
}

std::optional<double> number_at(const nlohmann::json& json, const char* pointer) {
  const nlohmann::json::json_pointer at(pointer);
  if (!json.contains(at) || !json[at].is_number()) return std::nullopt;
  return json[at].get<double>();
}

std::map<std::string, std::string> fingerprints_of(const fs::path& folder) {
  std::map<std::string, std::string> prints;
  for (const char* name : kFiles) {
    const auto bytes = read_file(folder / name, std::size_t{1} << 30);
    if (!bytes.ok()) continue;
    Fingerprint print;
    print.add(*bytes);
    prints[name] = print.text();
  }
  return prints;
}

std::optional<std::string> fault_of_files(const fs::path& folder, const RunRecord& record) {
  if (!has_figures(record.status)) return std::nullopt;
  if (!record.files.empty()) {
    const auto now = fingerprints_of(folder);
    for (const auto& [name, print] : record.files) {
      const auto found = now.find(name);
      if (found == now.end()) return name + ": is not there any more, or cannot be read";
      if (found->second != print) return name + ": not as the run left it";
    }
    return std::nullopt;
  }
  const auto metrics = read_metrics(folder / "metrics.json");
  if (metrics.ok()) return std::nullopt;
  return metrics.error().message.substr(folder.string().size() + 1);
}

}  // namespace ygslam
