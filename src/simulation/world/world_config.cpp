#include "simulation/world/world_config.hpp"

#include <algorithm>

#include "io/text.hpp"
#include "simulation/embedded_files.hpp"
#include "simulation/world/world_config_reader.hpp"

namespace ygslam::sim {

namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 20;

bool is_world_file(const std::string& file) {
  return file.ends_with(".yaml") && file.find('/') == std::string::npos;
}

}  // namespace

Result<WorldConfig> parse_world(const std::string& yaml, const std::string& source) {
  try {
    return read_world(YAML::Load(yaml), source);
  } catch (const YamlFault& fault) {
    return Error{ErrorKind::kInput, fault.what()};
  } catch (const YAML::Exception& e) {
    return Error{ErrorKind::kInput, source + ":" + std::to_string(e.mark.line + 1) + ": " + e.msg};
  }
}

Result<WorldConfig> load_world(const std::string& name_or_file) {
  std::string name = name_or_file;
  std::string text;
  if (const auto embedded = embedded_file(name_or_file + ".yaml");
      embedded && is_world_file(name_or_file + ".yaml")) {
    text = std::string(*embedded);
  } else if (name_or_file.ends_with(".yaml") || name_or_file.ends_with(".yml")) {
    auto file = read_file(name_or_file, kMostBytes);
    if (!file.ok()) return file.error();
    text = std::move(*file);
    name = name_or_file.substr(name_or_file.find_last_of('/') + 1);
    name = name.substr(0, name.find_last_of('.'));
  } else {
    std::string known;
    for (const WorldName& world : known_worlds()) known += (known.empty() ? "" : ", ") + world.name;
    return Error{ErrorKind::kUsage, "no world named '" + name_or_file +
                                        "' (a file's name ends in .yaml); known worlds: " + known};
  }
  Result<WorldConfig> world = parse_world(
      text, name_or_file.find('.') == std::string::npos ? name_or_file + ".yaml" : name_or_file);
  if (world) world->name = name;
  return world;
}

std::vector<WorldName> known_worlds() {
  std::vector<WorldName> worlds;
  for (const std::string& file : embedded_file_names()) {
    if (!is_world_file(file)) continue;
    const YAML::Node node = YAML::Load(std::string(*embedded_file(file)));
    worlds.push_back({file.substr(0, file.size() - 5), node["description"].as<std::string>("")});
  }
  std::sort(worlds.begin(), worlds.end(),
            [](const WorldName& a, const WorldName& b) { return a.name < b.name; });
  return worlds;
}

}  // namespace ygslam::sim
