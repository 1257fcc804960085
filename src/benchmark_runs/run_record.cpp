#include "benchmark_runs/run_record.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>

#include "io/json_text.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr int kFormat = 1;
constexpr std::array<std::pair<std::string_view, RunStatus>, 6> kStatusNames = {{
    {"ok", RunStatus::kOk},
    {"lost", RunStatus::kLost},
    {"failed", RunStatus::kFailed},
    {"crashed", RunStatus::kCrashed},
    {"timed_out", RunStatus::kTimedOut},
    {"bad_truth", RunStatus::kBadTruth},
}};

}  // namespace

std::string_view name_of(RunStatus status) {
  for (const auto& [name, known] : kStatusNames) {
    if (known == status) return name;
  }
  return "?";
}

std::filesystem::path RunKey::folder() const {
  std::array<char, 16> number{};
  std::snprintf(number.data(), number.size(), "%02d", run);
  return std::filesystem::path("runs") / sequence_id / mode / number.data();
}

bool has_figures(RunStatus status) {
  return status == RunStatus::kOk || status == RunStatus::kLost || status == RunStatus::kBadTruth;
}

bool comes_from_outside(int signal) {
  constexpr std::array kOutside = {SIGKILL, SIGTERM, SIGINT, SIGHUP, SIGQUIT};
  return std::find(kOutside.begin(), kOutside.end(), signal) != kOutside.end();
}

bool is_final(const RunRecord& record, double limit_s) {
  if (record.status == RunStatus::kCrashed) return !comes_from_outside(record.signal);
  if (record.status == RunStatus::kTimedOut) return limit_s > 0 && limit_s <= record.limit_s;
  return true;
}

nlohmann::ordered_json to_json(const RunRecord& r) {
  nlohmann::ordered_json json;
  json["format"] = kFormat;
  json["status"] = name_of(r.status);
  json["exit_code"] = r.exit_code;
  json["signal"] = r.signal;
  json["error"] = nullptr;
  if (r.error) json["error"] = *r.error;
  json["command"] = r.command;
  json["mode"] = r.mode;
  json["run"] = r.run;
  json["seed"] = r.seed;
  json["wall_s"] = r.wall_s;
  json["limit_s"] = r.limit_s;
  json["timings_valid"] = r.timings_valid;
  json["version"] = r.version;
  json["sequence_fingerprint"] = r.sequence_fingerprint;
  json["masks_fingerprint"] = r.masks_fingerprint;
  json["files"] = r.files;
  json["options"] = r.options;
  return json;
}

Result<RunRecord> read_run_record(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text.ok()) return text.error();
  return parse_run_record(*text, file.string());
}

Result<RunRecord> parse_run_record(std::string_view text, const std::string& name) {
  const auto json = parse_json(text, name);
  if (!json.ok()) return json.error();
  const auto fault = [&](const std::string& what) {
    return Error{ErrorKind::kInput, name + ": " + what};
  };
  try {
    if (json->at("format") != kFormat) return fault("of another format");
    RunRecord r;
    const std::string status = json->at("status");
    bool known = false;
    for (const auto& [known_status, value] : kStatusNames) {
      if (known_status == status) r.status = value;
      known |= known_status == status;
    }
    if (!known) return fault("unknown status");
    for (const char* key : {"exit_code", "signal", "run", "seed"})
      if (!json->at(key).is_number_integer())
        return fault(std::string(key) + " is no whole number");
    r.exit_code = json->at("exit_code");
    r.signal = json->at("signal");
    if (!json->at("error").is_null()) r.error = json->at("error").get<std::string>();
    r.command = json->at("command");
    r.mode = json->at("mode");
    r.run = json->at("run");
    r.seed = json->at("seed");
    r.wall_s = json->at("wall_s");
    r.timings_valid = json->at("timings_valid");
    r.version = json->at("version");
    r.sequence_fingerprint = json->value("sequence_fingerprint", "");
    r.limit_s = json->value("limit_s", 0.0);
    r.masks_fingerprint = json->value("masks_fingerprint", "");
    r.files = json->value("files", r.files);
    r.options = json->value("options", nlohmann::json::object());
    return r;
  } catch (const nlohmann::json::exception&) {
    return fault("a key is missing or has a value of another type");
  }
}

}  // namespace ygslam
