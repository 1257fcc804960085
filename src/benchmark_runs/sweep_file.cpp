#include "benchmark_runs/sweep_file.hpp"

#include <algorithm>
#include <map>

#include "io/json_text.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

using Json = nlohmann::ordered_json;
constexpr int kSweepFormat = 1;

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json sequence_json(const BenchSequence& s) {
  Json json;
  json["id"] = s.id;
  json["name"] = s.name;
  json["kind"] = s.kind;
  json["paper_row"] = or_null(s.paper_row);
  json["frames"] = s.frames;
  json["truth"] = nullptr;
  if (s.truth) {
    json["truth"] = {{"duration_s", s.truth->duration_s},
                     {"length_m", s.truth->length_m},
                     {"speed_mps", s.truth->speed_mps},
                     {"angular_speed_degps", s.truth->angular_speed_degps}};
  }
  json["error"] = or_null(s.error);
  return json;
}

// The entry of a sequence in an earlier file, or null.
nlohmann::json entry_of(const nlohmann::json& sweep, const std::string& id) {
  if (!sweep.is_object()) return nullptr;
  for (const auto& entry : sweep.at("sequences")) {
    if (entry.at("id") == id) return entry;
  }
  return nullptr;
}

// How many runs of each mode were asked for, as an earlier file tells it.
std::map<std::string, int> runs_asked(const nlohmann::json& sweep, const nlohmann::json& entry) {
  std::map<std::string, int> asked;
  if (entry.is_null()) return asked;
  if (entry.contains("runs_asked")) return entry["runs_asked"].get<std::map<std::string, int>>();
  for (const auto& mode : sweep.at("modes")) asked[mode] = sweep.at("options").at("runs");
  return asked;
}

Json runs_asked_json(const SweepOptions& options, const BenchSequence& sequence,
                     const nlohmann::json& earlier) {
  auto asked = runs_asked(earlier, entry_of(earlier, sequence.id));
  for (const std::string& mode : options.modes) asked[mode] = std::max(asked[mode], options.runs);
  return asked;
}

Json sequences_json(const SweepOptions& options, const std::vector<BenchSequence>& sequences,
                    const nlohmann::json& earlier) {
  std::vector<Json> list;
  list.reserve(sequences.size());
  for (const BenchSequence& sequence : sequences) {
    list.push_back(sequence_json(sequence));
    list.back()["runs_asked"] = runs_asked_json(options, sequence, earlier);
  }
  if (earlier.is_object()) {
    for (const auto& entry : earlier.at("sequences")) {
      const bool known = std::any_of(sequences.begin(), sequences.end(), [&](const auto& s) {
        return s.id == entry.at("id").template get<std::string>();
      });
      if (known) continue;
      list.emplace_back(entry);
      list.back()["runs_asked"] = runs_asked(earlier, entry);
    }
  }
  std::sort(list.begin(), list.end(), [](const Json& a, const Json& b) {
    return a["name"].get<std::string>() < b["name"].get<std::string>();
  });
  return list;
}

// Those asked for and those of an earlier call, in their customary order.
std::vector<std::string> all_modes(const SweepOptions& options, const nlohmann::json& earlier) {
  std::vector<std::string> modes;
  for (const std::string_view name : kSweepModes) {
    const std::string mode(name);
    const bool now =
        std::find(options.modes.begin(), options.modes.end(), mode) != options.modes.end();
    const bool before =
        earlier.is_object() && std::count(earlier.at("modes").begin(), earlier.at("modes").end(),
                                          nlohmann::json(mode)) > 0;
    if (now || before) modes.push_back(mode);
  }
  return modes;
}

int all_runs(const SweepOptions& options, const nlohmann::json& earlier) {
  if (!earlier.is_object()) return options.runs;
  return std::max(options.runs, earlier.at("options").at("runs").get<int>());
}

bool are_texts(const nlohmann::json& list) {
  return list.is_array() &&
         std::all_of(list.begin(), list.end(), [](const auto& entry) { return entry.is_string(); });
}

bool is_mode(const nlohmann::json& name) {
  return name.is_string() && std::find(kSweepModes.begin(), kSweepModes.end(),
                                       name.get<std::string>()) != kSweepModes.end();
}

bool is_runs_asked(const nlohmann::json& table) {
  if (!table.is_object()) return false;
  for (const auto& [mode, runs] : table.items()) {
    if (!is_mode(mode)) return false;
    if (!runs.is_number_integer() || runs < 0 || runs > kMostRuns) return false;
  }
  return true;
}

// What later readers rely on; empty if all is well.
std::string fault_of_values(const nlohmann::json& json) {
  const nlohmann::json& runs = json.at("options").at("runs");
  if (!runs.is_number_integer() || runs < 1 || runs > kMostRuns)
    return "runs is no sensible number";
  const nlohmann::json& modes = json.at("modes");
  if (!modes.is_array() || !std::all_of(modes.begin(), modes.end(), is_mode))
    return "modes is no list of modes";
  if (!json.at("sequences").is_array()) return "sequences is no list";
  if (!json.at("timings_valid").is_boolean()) return "timings_valid is neither true nor false";
  for (const auto& entry : json["sequences"]) {
    const nlohmann::json texts = {entry.at("id"), entry.at("name"), entry.at("kind")};
    if (!are_texts(texts)) return "a sequence has no name";
    if (!is_runs_asked(entry.value("runs_asked", nlohmann::json::object())))
      return "runs_asked of a sequence is no table of numbers";
  }
  return "";
}

}  // namespace

Json sweep_json(const SweepOptions& options, const nlohmann::json& comparable,
                const std::vector<BenchSequence>& sequences, const SweepFacts& facts,
                const nlohmann::json& earlier) {
  const std::vector<std::string> modes = all_modes(options, earlier);
  Json json;
  json["format"] = kSweepFormat;
  json["version"] = options.version;
  json["machine"] = options.machine;
  json["started"] = facts.started;
  json["wall_s"] = facts.wall_s;
  json["options"] = {
      {"modes", modes}, {"runs", all_runs(options, earlier)}, {"jobs", options.jobs}};
  const nlohmann::json merged =
      earlier.is_object() ? merged_options(comparable, earlier.at("options")) : comparable;
  for (const char* key : kComparableKeys) json["options"][key] = merged.at(key);
  json["timings_valid"] = facts.timings_valid;
  json["sequences"] = sequences_json(options, sequences, earlier);
  json["modes"] = modes;
  return json;
}

std::vector<RunKey> asked_runs(const nlohmann::json& sweep) {
  std::vector<RunKey> keys;
  if (!sweep.is_object()) return keys;
  for (const auto& entry : sweep.at("sequences")) {
    if (entry.contains("error") && entry["error"].is_string()) continue;
    for (const auto& [mode, runs] : runs_asked(sweep, entry)) {
      for (int run = 1; run <= runs; ++run) keys.push_back({entry.at("id"), mode, run});
    }
  }
  return keys;
}

Result<SweepFile> read_sweep_file(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text.ok()) return text.error();
  return parse_sweep_file(*text, file.string());
}

Result<SweepFile> parse_sweep_file(std::string_view text, const std::string& name) {
  auto json = parse_json(text, name);
  if (!json.ok()) return json.error();
  const auto fault = [&](const char* what) { return Error{ErrorKind::kInput, name + ": " + what}; };
  try {
    if (json->at("format") != kSweepFormat)
      return fault("of another format; made by another version?");
    SweepFile sweep;
    sweep.version = json->at("version");
    sweep.started = json->at("started");
    sweep.wall_s = json->at("wall_s");
    sweep.options = json->at("options");
    const std::string wrong = fault_of_values(*json);
    if (!wrong.empty()) return fault(wrong.c_str());
    for (const char* key : {"modes", "runs", "jobs"}) sweep.options.erase(key);
    if (!any_uses_masks(json->at("modes"))) sweep.options = options_of_mode(sweep.options, "off");
    sweep.json = std::move(*json);
    return sweep;
  } catch (const nlohmann::json::exception&) {
    return fault("a key is missing or has a value of another type");
  }
}

}  // namespace ygslam
