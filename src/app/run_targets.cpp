#include "app/run_targets.hpp"

#include <array>

#include "system/dense_file.hpp"

namespace ygslam {

std::string targets_text(const RunOptions& o, bool has_dense, bool has_background) {
  const std::string map = has_dense && !o.save_map.empty()
                              ? o.save_map + " with " + dense_file_of(o.save_map).string()
                              : o.save_map;
  const std::array<std::pair<std::string, const char*>, 5> others = {
      {{o.export_dir, "--export"},
       {map, "--save-map"},
       {o.mcap, "--mcap"},
       {has_background ? o.background_dir : "", "--background"},
       {o.debug_dir, "--debug-images"}}};
  std::string text = "written: " + o.out_dir;
  for (const auto& [path, option] : others)
    if (!path.empty()) text += ", " + path + " (" + option + ")";
  return text;
}

}  // namespace ygslam
