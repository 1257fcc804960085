#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "system/slam_config.hpp"

namespace ygslam::fuzz {

void settings(std::string_view bytes) {
  SlamConfig config;
  ConfigSchema schema = schema_of(config);
  const Status loaded = schema.load_yaml_text(std::string(bytes), "settings.yaml");
  // Taken or not, every value stays within its range, and what is written reads back the same.
  for (const ConfigKey& key : schema.keys()) CHECK(key.set(key.get()), key.name.c_str());
  if (!loaded.ok() || !validate(config).ok()) return;
  SlamConfig again;
  ConfigSchema schema_again = schema_of(again);
  CHECK(schema_again.load_yaml_text(schema.to_yaml(), "written.yaml").ok());
  CHECK(schema_again.to_yaml() == schema.to_yaml());
}

}  // namespace ygslam::fuzz
