#include "benchmark_runs/sweep_options.hpp"

#include <algorithm>
#include <cctype>

#include "benchmark_runs/fingerprint.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kMasks = "masks:";
constexpr std::string_view kPlainMarks = "_-./=:,+@%";  // beside letters and digits

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

// Of a folder of this machine only the name is told; what is in it decides (masks_fingerprint).
std::string shown_segmenter(const std::string& segmenter) {
  if (!segmenter.starts_with(kMasks)) return segmenter;
  const fs::path folder = fs::path(segmenter.substr(kMasks.size())).lexically_normal();
  if (folder.is_relative()) return segmenter;
  return std::string(kMasks) +
         (folder.has_filename() ? folder : folder.parent_path()).filename().string();
}

nlohmann::json without_mask_keys(nlohmann::json options) {
  if (!options.is_object()) return options;
  for (const char* key : kMaskKeys) options[key] = nullptr;
  return options;
}

bool tells_of_masks(const nlohmann::json& options) {
  return options.is_object() && options.contains("segmenter") && !options["segmenter"].is_null();
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

// As a POSIX shell reads it back; of a quoted word only the quote itself is special.
std::string quoted(const std::string& word) {
  const auto is_plain = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x80 || std::isalnum(byte) != 0 || kPlainMarks.find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), is_plain)) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

std::optional<std::string> first_difference(const nlohmann::json& before,
                                            const nlohmann::json& now) {
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
    if (a.is_object() || b.is_object()) {
      if (auto inner = first_difference(a, b)) return inner;
      continue;  // an empty object is as good as none
    }
    if (key == "model_content") return "the model's content has changed";
    return key + " was " + shown(a) + ", is now " + shown(b);
  }
  return std::nullopt;
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

bool mode_uses_masks(std::string_view mode) { return mode == "semantic" || mode == "full"; }

bool any_uses_masks(const std::vector<std::string>& modes) {
  return std::any_of(modes.begin(), modes.end(), mode_uses_masks);
}

nlohmann::json comparable_options(const SweepOptions& o) {
  nlohmann::json json = {{"way", name_of(o.schedule)},
                         {"seed", o.seed},
                         {"segmenter", shown_segmenter(o.segmenter)},
                         {"precision", o.precision},
                         {"config", o.config}};
  json["model"] = nullptr;
  json["model_content"] = nullptr;
  if (!any_uses_masks(o.modes)) return without_mask_keys(std::move(json));
  if (!o.model.empty()) {
    json["model"] = o.model.filename().string();
    json["model_content"] = content_of(o.model);
  }
  return json;
}

nlohmann::json options_of_mode(nlohmann::json comparable, std::string_view mode) {
  return mode_uses_masks(mode) ? comparable : without_mask_keys(std::move(comparable));
}

nlohmann::json merged_options(nlohmann::json now, const nlohmann::json& before) {
  if (tells_of_masks(now) || !tells_of_masks(before)) return now;
  for (const char* key : kMaskKeys) now[key] = before.value(key, nlohmann::json());
  return now;
}

std::optional<std::string> difference(const nlohmann::json& before, const nlohmann::json& now) {
  if (tells_of_masks(before) != tells_of_masks(now)) {
    return first_difference(without_mask_keys(before), without_mask_keys(now));
  }
  return first_difference(before, now);
}

double run_limit_s(const SweepOptions& options, const BenchSequence& sequence) {
  constexpr double kAtLeast_s = 600, kTimesDuration = 30;
  return options.run_limit_s.value_or(kAtLeast_s + kTimesDuration * sequence.duration_s);
}

std::uint64_t seed_of(const SweepOptions& options, const RunKey& key) {
  return options.seed + static_cast<std::uint64_t>(key.run - 1);
}

std::optional<fs::path> masks_folder(const SweepOptions& o, const BenchSequence& sequence) {
  if (!o.segmenter.starts_with(kMasks)) return std::nullopt;
  return sequence.folder / o.segmenter.substr(kMasks.size());
}

std::vector<std::string> mask_options(const SweepOptions& o, const BenchSequence& sequence) {
  const auto folder = masks_folder(o, sequence);
  std::vector<std::string> words = {"--segmenter",
                                    folder ? std::string(kMasks) + folder->string() : o.segmenter};
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
    if (o.segmenter != "model") text += " --segmenter " + quoted(shown_segmenter(o.segmenter));
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
