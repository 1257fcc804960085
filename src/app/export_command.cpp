#include "app/commands.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "app/file_uses.hpp"
#include "app/program_log.hpp"
#include "app/run_options.hpp"
#include "app/scene_output.hpp"
#include "core/log.hpp"
#include "dense/scene_naming/named_scene.hpp"
#include "io/atomic_file.hpp"
#include "map_file/map_file.hpp"
#include "system/dense_beside.hpp"

namespace ygslam {
namespace {

struct ExportArguments {
  RunOptions settings;  // --config and --set alone
  std::string map, out;
};

Result<DenseMapConfig> dense_config(const ExportArguments& a) {
  const auto settings = load_settings(a.settings);
  if (!settings.ok()) return settings.error();
  if (Status fits = fits_in_memory(settings->dense); !fits.ok()) return fits.error();
  return settings->dense;
}

Status check_scene_files(const ExportArguments& a) {
  FileUses uses;
  uses.reads_map("MAP", a.map);
  uses.writes_in("--out", a.out, scene_files());
  return uses.check();
}

Status export_saved(const ExportArguments& a) {
  if (Status checked = check_scene_files(a); !checked.ok()) return checked;
  const auto config = dense_config(a);
  if (!config.ok()) return config.error();
  const auto info = read_map_info(a.map);
  if (!info.ok()) return info.error();
  const auto map = load_map(a.map);
  if (!map.ok()) return map.error();
  const std::filesystem::path file = dense_file_of(a.map);
  std::error_code code;
  if (!std::filesystem::exists(file, code))
    return Error{ErrorKind::kSavedMap, file.string() + ": not there: the map was saved without it"};
  const Camera camera(info->camera);
  const auto beside = load_dense_beside(file, *map, camera);
  if (!beside.ok()) return beside.error();
  if (!beside->foreign.empty())
    return Error{ErrorKind::kSavedMap, file.string() + ": " + beside->foreign};
  if (Status writable = ensure_writable_directory(a.out); !writable.ok()) return writable;

  DenseMap dense(*config, camera);
  if (beside->left_out > 0)
    log::warn("{}: {} views are of keyframes that the map has not", file.string(),
              beside->left_out);
  dense.restore(beside->views);
  DenseUpdate poses;
  const auto roots = map->keyframes().empty() ? std::map<KeyframeId, KeyframeId>{} : map->roots();
  for (const auto& [id, root] : roots)
    if (root == map->main_root())
      poses.T_world_camera[id] = map->keyframe(id).T_camera_world.inverse();
  dense.apply(poses);
  dense.finish();
  const StaticScene scene = named_scene(dense);
  Status written = write_scene(a.out, scene);
  if (written.ok() && !is_quiet())
    std::printf("%zu views, %zu triangles, %zu objects\n", beside->views.size(),
                scene.mesh.triangles.size(), scene.objects.size());
  if (written.ok()) tell_written(a.out);
  return written;
}

}  // namespace

void add_export_command(CLI::App& app, int& exit_code) {
  const auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand("export", "Write the static scene of a saved map");
  command->add_option("MAP", arguments->map, "Of `ygslam run --save-map`")
      ->required()
      ->type_name("FILE");
  command->add_option("--out", arguments->out, "Folder for the scene")
      ->required()
      ->type_name("DIR");
  command
      ->add_option("--config", arguments->settings.config_file,
                   "Settings (see `ygslam config`); those of dense count")
      ->type_name("FILE.yaml");
  command->add_option("--set", arguments->settings.sets, "One setting; may be repeated")
      ->type_name("KEY=VALUE");
  command->footer(
      "Examples:\n"
      "  ygslam run SEQ --out out --save-map room.map\n"
      "  ygslam export room.map --out scene\n"
      "  ygslam export room.map --out fine --set dense.voxel_m=0.01\n"
      "Writes cloud.ply, cloud.pcd, mesh.ply, mesh.glb, space.bt, space.ot, "
      "grid.yaml,\n"
      "grid.pgm, objects.json and labels.json (docs/exports.md). Exit codes: 0 ok, 2 usage, 3 "
      "settings, 6 map file "
      "damaged\n"
      "or without its .dense, 9 output not written.");
  command->callback([arguments, &exit_code] {
    const Status done = export_saved(*arguments);
    if (done.ok()) return;
    log::error("{}", done.error().message);
    exit_code = static_cast<int>(done.error().kind);
  });
}

}  // namespace ygslam
