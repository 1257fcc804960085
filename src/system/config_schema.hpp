// Every configuration key with its place in the settings: one table serves reading, writing,
// checking and `ygslam config`.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/result.hpp"

namespace ygslam {

/// What is wrong with settings, all of it at once.
class ConfigFaults {
 public:
  void add(std::string_view clause) { clauses_.emplace_back(clause); }
  void add(const Status& status) {
    if (!status.ok()) add(status.error().message);
  }
  [[nodiscard]] bool empty() const { return clauses_.empty(); }
  /// Ok, or one kConfig error of one line: `source` and the clauses, of very many the first.
  [[nodiscard]] Status status(const std::string& source = "") const;

 private:
  std::vector<std::string> clauses_;
};

struct ConfigKey {
  std::string name;  ///< dotted, e.g. "motion.tau_px"
  std::string unit;  ///< "" where it has none
  std::string meaning;
  std::string when;   ///< a user would change it
  std::string range;  ///< what is allowed, as text
  std::function<std::string()> get;
  std::function<bool(const std::string&)> set;  ///< false: not of the type or out of range
};

class ConfigSchema {
 public:
  template <typename T>
  void number(const std::string& name, T& field, T low, T high, const std::string& unit,
              const std::string& meaning, const std::string& when);
  /// A list of words, written "[a, b]".
  void words(const std::string& name, std::vector<std::string>& field, const std::string& meaning,
             const std::string& when);
  template <typename E>
  void choice(const std::string& name, E& field, std::vector<std::pair<std::string, E>> options,
              const std::string& meaning, const std::string& when);

  [[nodiscard]] const std::vector<ConfigKey>& keys() const { return keys_; }
  /// @param source names the file or option in the error.
  [[nodiscard]] Status set(const std::string& name, const std::string& value,
                           const std::string& source);
  /// Reads a YAML file of nested maps: sets what is right and tells of all that is wrong, unknown
  /// keys (naming the nearest), keys given twice, values out of range.
  [[nodiscard]] Status load_yaml(const std::string& path);
  /// The same from its text. @param name of the file, for the error.
  [[nodiscard]] Status load_yaml_text(const std::string& text, const std::string& name);
  [[nodiscard]] std::string to_yaml() const;
  [[nodiscard]] std::optional<std::string> nearest(const std::string& name) const;

 private:
  std::vector<ConfigKey> keys_;
};

/// Text to number without regard to the locale; the whole text must be used, no NaN, no infinity.
[[nodiscard]] std::optional<double> parse_finite(const std::string& text);
[[nodiscard]] std::string format_number(double value);

template <typename T>
void ConfigSchema::number(const std::string& name, T& field, T low, T high, const std::string& unit,
                          const std::string& meaning, const std::string& when) {
  static_assert(std::is_arithmetic_v<T>);
  const auto range =
      format_number(static_cast<double>(low)) + " .. " + format_number(static_cast<double>(high));
  keys_.push_back(
      {name, unit, meaning, when, range,
       [&field] { return format_number(static_cast<double>(field)); },
       [&field, low, high](const std::string& text) {
         const auto value = parse_finite(text);
         if (!value || *value < static_cast<double>(low) || *value > static_cast<double>(high)) {
           return false;
         }
         if (std::is_integral_v<T> && *value != static_cast<double>(static_cast<T>(*value))) {
           return false;
         }
         field = static_cast<T>(*value);
         return true;
       }});
}

template <typename E>
void ConfigSchema::choice(const std::string& name, E& field,
                          std::vector<std::pair<std::string, E>> options,
                          const std::string& meaning, const std::string& when) {
  std::string range;
  for (const auto& [word, value] : options) range += (range.empty() ? "" : " | ") + word;
  keys_.push_back({name, "", meaning, when, range,
                   [&field, options] {
                     for (const auto& [word, value] : options) {
                       if (value == field) return word;
                     }
                     return std::string();
                   },
                   [&field, options](const std::string& text) {
                     for (const auto& [word, value] : options) {
                       if (word != text) continue;
                       field = value;
                       return true;
                     }
                     return false;
                   }});
}

}  // namespace ygslam
