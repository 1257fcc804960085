// Reads YAML maps strictly: every key must be known, every value of the right type, and a complaint
// names file, line and key. For the .cpp files of simulation/.
#pragma once

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

#include "simulation/surface/mesh.hpp"

namespace ygslam::sim {

/// Thrown while a file is read; caught where the reading starts.
struct YamlFault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// No number of a scene (metres, seconds, degrees) is larger; beyond, floats lose the millimetre.
inline constexpr double kMost = 1e4;
/// No place is farther from the middle of the world.
inline constexpr double kFarthest_m = 1000;
/// Of the looks of a thing or of clothes.
inline constexpr int kMostVariants = 100000;

/// One map of the file. Keys are asked for by name; finish() complains about the ones nobody asked
/// for.
class YamlMap {
 public:
  YamlMap(const YAML::Node& node, std::string source) : node_(node), source_(std::move(source)) {
    if (!node_.IsMap()) throw fault(node_, "a map of keys and values is expected");
    std::set<std::string> seen;
    for (const auto& entry : node_) {
      const auto key = entry.first.as<std::string>();
      if (!seen.insert(key).second) throw fault(entry.first, "'" + key + "' is there twice");
    }
  }

  [[nodiscard]] bool has(const std::string& key) {
    known_.insert(key);
    return node_[key].IsDefined();
  }
  /// Writes the value if the key is there.
  template <typename T>
  void read(const std::string& key, T& value) {
    if (!has(key)) return;
    try {
      value = node_[key].as<T>();
    } catch (const YAML::Exception&) {
      throw fault(node_[key], "'" + key + "' has a value of the wrong type");
    }
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(value)) throw fault(node_[key], "'" + key + "' is not a finite number");
      if (std::abs(value) > kMost) throw fault(node_[key], "'" + key + "' is out of all bounds");
    }
  }
  /// A number that has to lie between two others.
  template <typename T>
  void read(const std::string& key, T& value, T least, T most) {
    read(key, value);
    if (value >= least && value <= most) return;
    std::ostringstream range;
    range << "'" << key << "' is " << least << " to " << most;
    throw fault(has(key) ? node_[key] : node_, range.str());
  }
  template <int N>
  void read(const std::string& key, Eigen::Matrix<double, N, 1>& value) {
    if (has(key)) value = vector<N>(node_[key], key);
  }
  template <int N>
  [[nodiscard]] Eigen::Matrix<double, N, 1> vector(const YAML::Node& node,
                                                   const std::string& key) const {
    Eigen::Matrix<double, N, 1> value;
    if (!node.IsSequence() || node.size() != N) {
      throw fault(node, "'" + key + "' needs " + std::to_string(N) + " numbers");
    }
    for (int i = 0; i < N; ++i) {
      try {
        value[i] = node[i].as<double>();
      } catch (const YAML::Exception&) {
        throw fault(node, "'" + key + "' needs " + std::to_string(N) + " numbers");
      }
      if (!std::isfinite(value[i])) throw fault(node, "'" + key + "' is not finite");
      if (std::abs(value[i]) > kFarthest_m)
        throw fault(node, "'" + key + "' is farther than 1000 m from the middle");
    }
    return value;
  }
  /// The entries of a list; none if the key is missing.
  [[nodiscard]] std::vector<YAML::Node> list(const std::string& key) {
    std::vector<YAML::Node> entries;
    if (!has(key)) return entries;
    if (!node_[key].IsSequence()) throw fault(node_[key], "'" + key + "' needs a list");
    for (const YAML::Node& entry : node_[key]) entries.push_back(entry);
    return entries;
  }
  [[nodiscard]] YAML::Node node(const std::string& key) const { return node_[key]; }
  [[nodiscard]] const std::string& source() const { return source_; }

  void finish() const {
    for (const auto& entry : node_) {
      const auto key = entry.first.as<std::string>();
      if (known_.contains(key)) continue;
      std::string allowed;
      for (const std::string& name : known_) allowed += (allowed.empty() ? "" : ", ") + name;
      throw fault(entry.first, "unknown key '" + key + "' (known: " + allowed + ")");
    }
  }
  [[nodiscard]] YamlFault fault(const YAML::Node& node, const std::string& message) const {
    const int line = std::max(1, node.Mark().line + 1);  // an empty file has no line
    return YamlFault(source_ + ":" + std::to_string(line) + ": " + message);
  }

 private:
  YAML::Node node_;
  std::string source_;
  std::set<std::string> known_;
};

}  // namespace ygslam::sim
