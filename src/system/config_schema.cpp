#include "system/config_schema.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "core/edit_distance.hpp"

namespace ygslam {
namespace {

constexpr int kMaxDepth = 8;
constexpr std::uintmax_t kMaxFileBytes = 1 << 20;
// A small file may stand for a huge tree: each alias repeats what its anchor holds.
constexpr int kMaxEntries = 10000;
constexpr std::size_t kMaxValueBytes = 1 << 16;
constexpr std::size_t kMaxKeyBytes = 200;  // the nearest key is sought by edit distance

// A scalar or a flow list as the text that ConfigKey::set takes; cut off where it is far too long
// for any key.
std::string scalar_text(const YAML::Node& node) {
  if (!node.IsSequence()) return node.as<std::string>("").substr(0, kMaxValueBytes);
  std::string text = "[";
  for (const YAML::Node& item : node) {
    if (text.size() > kMaxValueBytes) break;
    text += (text.size() > 1 ? ", " : "") + item.as<std::string>("").substr(0, kMaxValueBytes);
  }
  return text + "]";
}

Status load_node(ConfigSchema& schema, const YAML::Node& node, const std::string& prefix,
                 const std::string& path, int depth, int& entries_left) {
  if (depth > kMaxDepth) return Error{ErrorKind::kConfig, path + ": nested too deep at " + prefix};
  for (const auto& entry : node) {
    if (--entries_left < 0) return Error{ErrorKind::kConfig, path + ": too many entries"};
    const std::string key = entry.first.as<std::string>("").substr(0, kMaxKeyBytes);
    const std::string name = (prefix.empty() ? "" : prefix + ".") + key;
    Status status = Ok{};
    if (entry.second.IsMap()) {
      status = load_node(schema, entry.second, name, path, depth + 1, entries_left);
    } else {
      const std::string text = scalar_text(entry.second);
      if (text.size() > kMaxValueBytes) {
        return Error{ErrorKind::kConfig, path + ": value of " + name + " is too long"};
      }
      status = schema.set(name, text, path);
    }
    if (!status.ok()) return status;
  }
  return Ok{};
}

std::vector<std::string> split_words(std::string text) {
  std::erase_if(text, [](char c) { return c == '[' || c == ']' || c == '"' || c == '\''; });
  std::vector<std::string> words;
  std::istringstream stream(text);
  for (std::string word; std::getline(stream, word, ',');) {
    const auto first = word.find_first_not_of(' ');
    if (first == std::string::npos) continue;
    words.push_back(word.substr(first, word.find_last_not_of(' ') - first + 1));
  }
  return words;
}

std::string join_words(const std::vector<std::string>& words) {
  std::string text = "[";
  for (const auto& word : words) text += (text.size() > 1 ? ", " : "") + word;
  return text + "]";
}

}  // namespace

void ConfigSchema::flag(const std::string& name, bool& field, const std::string& meaning) {
  choice<bool>(name, field, {{"true", true}, {"false", false}}, meaning);
}

void ConfigSchema::words(const std::string& name, std::vector<std::string>& field,
                         const std::string& meaning) {
  keys_.push_back({name, "", meaning, "list", [&field] { return join_words(field); },
                   [&field](const std::string& text) {
                     field = split_words(text);
                     return true;
                   }});
}

Status ConfigSchema::set(const std::string& name, const std::string& value,
                         const std::string& source) {
  const auto key =
      std::find_if(keys_.begin(), keys_.end(), [&](const ConfigKey& k) { return k.name == name; });
  if (key == keys_.end()) {
    const auto near = nearest(name);
    return Error{ErrorKind::kConfig, source + ": unknown key '" + name + "'" +
                                         (near ? ", did you mean '" + *near + "'?" : "")};
  }
  if (!key->set(value)) {
    return Error{ErrorKind::kConfig,
                 source + ": " + name + " = '" + value + "' is not in " + key->range};
  }
  return Ok{};
}

Status ConfigSchema::load_yaml(const std::string& path) {
  std::error_code code;
  const auto size = std::filesystem::file_size(path, code);
  if (code) return Error{ErrorKind::kConfig, path + ": " + code.message()};
  if (size > kMaxFileBytes) return Error{ErrorKind::kConfig, path + ": larger than 1 MiB"};
  try {
    const YAML::Node root = YAML::LoadFile(path);
    if (root.IsNull()) return Ok{};
    if (!root.IsMap()) return Error{ErrorKind::kConfig, path + ": not a map of keys"};
    int entries_left = kMaxEntries;
    return load_node(*this, root, "", path, 0, entries_left);
  } catch (const YAML::Exception& e) {
    return Error{ErrorKind::kConfig, path + ":" + std::to_string(e.mark.line + 1) + ": " + e.msg};
  }
}

std::string ConfigSchema::to_yaml() const {
  std::string text;
  std::string section;
  for (const ConfigKey& key : keys_) {
    const auto dot = key.name.find('.');
    if (key.name.substr(0, dot) != section) {
      section = key.name.substr(0, dot);
      text += section + ":\n";
    }
    text += "  " + key.name.substr(dot + 1) + ": " + key.get() + "\n";
  }
  return text;
}

std::optional<std::string> ConfigSchema::nearest(const std::string& name) const {
  std::optional<std::string> best;
  std::size_t best_distance = std::max<std::size_t>(3, name.size() / 2);
  for (const ConfigKey& key : keys_) {
    // A forgotten section is a common slip: compare the last word too.
    const std::string last = key.name.substr(key.name.find('.') + 1);
    const std::size_t d = std::min(edit_distance(name, key.name), edit_distance(name, last) + 1);
    if (d >= best_distance) continue;
    best_distance = d;
    best = key.name;
  }
  return best;
}

std::optional<double> parse_finite(const std::string& text) {
  double value = 0;
  const auto* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::string format_number(double value) {
  char buffer[40];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, result.ptr};
}

}  // namespace ygslam
