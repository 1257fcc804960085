#include "system/config_schema.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <sstream>

#include "core/edit_distance.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr int kMaxDepth = 8;
constexpr std::size_t kMaxFileBytes = 1 << 20;
constexpr std::size_t kMostClauses = 50;
// A small file may stand for a huge tree: each alias repeats what its anchor holds.
constexpr int kMaxEntries = 10000;
constexpr std::size_t kMaxValueBytes = 1 << 16;

// A scalar or a list, of lists perhaps, as the text that ConfigKey::set takes; cut off where it is
// far too long for any key. A list may be an item of itself: no deeper than two.
std::string scalar_text(const YAML::Node& node, int levels = 2) {
  if (!node.IsSequence()) return node.as<std::string>("").substr(0, kMaxValueBytes);
  std::string text = "[";
  for (const YAML::Node& item : node) {
    if (text.size() > kMaxValueBytes) break;
    text += text.size() > 1 ? ", " : "";
    text += item.IsSequence() ? (levels > 1 ? scalar_text(item, levels - 1) : "[...]")
                              : item.as<std::string>("").substr(0, kMaxValueBytes);
  }
  return text + "]";
}

/// A settings file as it is read.
struct Reading {
  ConfigSchema& schema;
  ConfigFaults faults;
  std::set<std::string> seen;  // keys and sections
  int entries_left = kMaxEntries;
};

// @return false where nothing more is worth reading.
bool load_node(Reading& reading, const YAML::Node& node, const std::string& prefix, int depth) {
  const auto fault = [&](const YAML::Node& at, const std::string& what) {
    reading.faults.add("line " + std::to_string(at.Mark().line + 1) + ": " + what);
  };
  for (const auto& entry : node) {
    const YAML::Node& key = entry.first;
    const YAML::Node& value = entry.second;
    if (--reading.entries_left < 0) {
      fault(key, "too many entries");
      return false;
    }
    const std::string word = printable(key.IsScalar() ? key.Scalar() : std::string());
    const std::string name = (prefix.empty() ? "" : prefix + ".") + word;
    if (!reading.seen.insert(name).second) {
      fault(key, "'" + name + "' is given twice");
    } else if (value.IsMap()) {
      if (depth == kMaxDepth) {
        fault(key, "nested too deep at " + name);
        return false;
      }
      if (!load_node(reading, value, name, depth + 1)) return false;
    } else if (const std::string text = scalar_text(value); text.size() > kMaxValueBytes) {
      fault(value, "value of " + name + " is too long");
    } else if (const Status status = reading.schema.set(name, text, ""); !status.ok()) {
      fault(key, status.error().message);
    }
  }
  return true;
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

Status ConfigFaults::status(const std::string& source) const {
  if (clauses_.empty()) return Ok{};
  std::string message = source;
  for (std::size_t i = 0; i < std::min(clauses_.size(), kMostClauses); ++i)
    message += (i > 0 ? "; " : source.empty() ? "" : ": ") + clauses_[i];
  if (clauses_.size() > kMostClauses)
    message += "; and " + std::to_string(clauses_.size() - kMostClauses) + " more";
  return Error{ErrorKind::kConfig, message};
}

void ConfigSchema::words(const std::string& name, std::vector<std::string>& field,
                         const std::string& meaning, const std::string& when) {
  keys_.push_back({name, "", meaning, when, "list", [&field] { return join_words(field); },
                   [&field](const std::string& text) {
                     field = split_words(text);
                     return true;
                   }});
}

Status ConfigSchema::set(const std::string& name, const std::string& value,
                         const std::string& source) {
  const std::string prefix = source.empty() ? "" : source + ": ";
  const auto key =
      std::find_if(keys_.begin(), keys_.end(), [&](const ConfigKey& k) { return k.name == name; });
  if (key == keys_.end()) {
    const auto near = nearest(name);
    return Error{ErrorKind::kConfig, prefix + "unknown key '" + printable(name) + "'" +
                                         (near ? ", did you mean '" + *near + "'?" : "")};
  }
  if (!key->set(value)) {
    return Error{ErrorKind::kConfig,
                 prefix + name + " = '" + printable(value) + "' is not in " + key->range};
  }
  return Ok{};
}

Status ConfigSchema::load_yaml(const std::string& path) {
  const auto text = read_file(path, kMaxFileBytes);
  if (!text.ok()) return Error{ErrorKind::kConfig, text.error().message};
  return load_yaml_text(*text, path);
}

namespace {

/// A line `---` or `...`, which may have content behind it.
bool is_document_marker(std::string_view line) {
  const bool is_marker = line.starts_with("---") || line.starts_with("...");
  return is_marker &&
         (line.size() == 3 || std::string_view(" \t\r").find(line[3]) != std::string_view::npos);
}

/// YAML::Load() reads the first and drops the rest; YAML::LoadAll() never ends on some damaged
/// text.
bool has_several_documents(std::string_view text) {
  bool has_content = false, is_next = false;
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    if (is_document_marker(line)) {
      is_next = has_content;
      line.remove_prefix(3);
    }
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#' || line.starts_with('%')) continue;
    if (is_next) return true;
    has_content = true;
  }
  return false;
}

}  // namespace

Status ConfigSchema::load_yaml_text(const std::string& text, const std::string& name) {
  const auto fault = [&](const std::string& what) {
    return Error{ErrorKind::kConfig, name + ": " + what};
  };
  try {
    if (has_several_documents(text))
      return fault("has several documents, parted by lines `---`: keep one");
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull()) return Ok{};
    if (!root.IsMap()) return fault("not a map of keys");
    Reading reading{*this, {}, {}};
    load_node(reading, root, "", 0);
    return reading.faults.status(name);
  } catch (const YAML::Exception& e) {
    return fault("line " + std::to_string(e.mark.line + 1) + ": " + e.msg);
  }
}

std::string ConfigSchema::to_yaml() const {
  std::vector<std::pair<std::string, std::string>> sections;  // in the order of their first keys
  for (const ConfigKey& key : keys_) {
    const auto dot = key.name.find('.');
    const std::string name = key.name.substr(0, dot);
    auto section = std::find_if(sections.begin(), sections.end(),
                                [&](const auto& s) { return s.first == name; });
    if (section == sections.end()) section = sections.insert(section, {name, name + ":\n"});
    section->second += "  " + key.name.substr(dot + 1) + ": " + key.get() + "\n";
  }
  std::string text;
  for (const auto& [name, lines] : sections) text += lines;
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
