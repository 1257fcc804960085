#include "sweep/sweep_options.hpp"

#include "io/text.hpp"
#include "sweep/fingerprint.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kMasks = "masks:";

std::string content_of(const fs::path& model) {
  Fingerprint print;
  fs::path weights = model;  // OpenVINO's IR: the .xml names the layers, the .bin holds the weights
  weights.replace_extension(".bin");
  for (const fs::path& file : {model, model.extension() == ".xml" ? weights : model}) {
    const auto bytes = read_file(file, std::size_t{1} << 30);
    print.add(bytes.ok() ? *bytes : "");
  }
  return print.text();
}

std::string shown(const nlohmann::json& value) {
  if (value.is_null()) return "not set";
  return printable(value.is_string() ? value.get<std::string>() : value.dump());
}

std::string segmenter_argument(const SweepOptions& o, const BenchSequence& sequence) {
  if (!o.segmenter.starts_with(kMasks)) return o.segmenter;
  return std::string(kMasks) + (sequence.folder / o.segmenter.substr(kMasks.size())).string();
}

std::vector<std::string> settings(const SweepOptions& o, const RunKey& key) {
  std::vector<std::string> words = {"--dynamic", key.mode, "--seed",
                                    std::to_string(seed_of(o, key))};
  if (o.schedule == Schedule::kRealtime) words.emplace_back("--realtime");
  if (o.schedule == Schedule::kDeterministic) words.emplace_back("--deterministic");
  for (const auto& [name, value] : o.config) {
    words.emplace_back("--set");
    words.push_back(name + "=" + value);
  }
  return words;
}

std::string quoted(const std::string& word) {
  if (word.find_first_of(" \"'$&;()[]*?<>|\\") == std::string::npos) return word;
  return "'" + word + "'";
}

}  // namespace

std::string_view name_of(Schedule schedule) {
  switch (schedule) {
    case Schedule::kFile:
      return "as fast as possible";
    case Schedule::kRealtime:
      return "realtime";
    case Schedule::kDeterministic:
      return "deterministic";
  }
  return "?";
}

bool mode_uses_masks(const std::string& mode) { return mode == "semantic" || mode == "full"; }

nlohmann::json comparable_options(const SweepOptions& o) {
  nlohmann::json json = {{"way", name_of(o.schedule)},
                         {"seed", o.seed},
                         {"segmenter", o.segmenter},
                         {"precision", o.precision},
                         {"config", o.config}};
  json["model"] = nullptr;
  json["model_content"] = nullptr;
  if (!o.model.empty()) {
    json["model"] = o.model.filename().string();
    json["model_content"] = content_of(o.model);
  }
  return json;
}

std::optional<std::string> difference(const nlohmann::json& before, const nlohmann::json& now) {
  static const nlohmann::json none;
  const auto value = [](const nlohmann::json& json, const std::string& key) -> const auto& {
    return json.is_object() && json.contains(key) ? json[key] : none;
  };
  nlohmann::json keys = now.is_object() ? now : nlohmann::json::object();
  if (before.is_object()) keys.update(before);
  for (const auto& [key, ignored] : keys.items()) {
    const nlohmann::json& a = value(before, key);
    const nlohmann::json& b = value(now, key);
    if (a == b) continue;
    if (a.is_object() || b.is_object()) return difference(a, b);
    if (key == "model_content") return "the model's content has changed";
    return key + " was " + shown(a) + ", is now " + shown(b);
  }
  return std::nullopt;
}

std::uint64_t seed_of(const SweepOptions& options, const RunKey& key) {
  return options.seed + static_cast<std::uint64_t>(key.run - 1);
}

std::vector<std::string> mask_options(const SweepOptions& o, const BenchSequence& sequence) {
  std::vector<std::string> words = {"--segmenter", segmenter_argument(o, sequence)};
  if (!o.model.empty()) words.insert(words.end(), {"--model", o.model.string()});
  return words;
}

std::vector<std::string> run_command(const SweepOptions& o, const BenchSequence& sequence,
                                     const RunKey& key) {
  std::vector<std::string> words = {o.program.string(), "run", sequence.folder.string(), "--out",
                                    (o.out / key.folder()).string()};
  if (mode_uses_masks(key.mode)) {
    const auto masks = mask_options(o, sequence);
    words.insert(words.end(), masks.begin(), masks.end());
  }
  const auto more = settings(o, key);
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::string shown_command(const SweepOptions& o, const BenchSequence& sequence, const RunKey& key) {
  std::string text = "ygslam run " + quoted(sequence.name) + " --out " + key.folder().string();
  if (mode_uses_masks(key.mode)) {
    if (o.segmenter != "model") text += " --segmenter " + quoted(o.segmenter);
    if (!o.model.empty()) text += " --model " + quoted(o.model.filename().string());
  }
  for (const std::string& word : settings(o, key)) text += " " + quoted(word);
  return text;
}

std::vector<RunKey> planned_runs(const SweepOptions& options,
                                 const std::vector<BenchSequence>& sequences) {
  std::vector<RunKey> keys;
  for (int run = 1; run <= options.runs; ++run) {
    for (const BenchSequence& sequence : sequences) {
      if (sequence.error) continue;
      for (const std::string& mode : options.modes) keys.push_back({sequence.id, mode, run});
    }
  }
  return keys;
}

}  // namespace ygslam
