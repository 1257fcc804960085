#include "app/commands.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/exit_code.hpp"
#include "app/file_uses.hpp"
#include "app/program_log.hpp"
#include "app/standard_streams.hpp"
#include "core/counted.hpp"
#include "core/log.hpp"
#include "io/atomic_file.hpp"
#include "io/ply.hpp"
#include "io/text.hpp"
#include "io/trajectory.hpp"
#include "map/map_bytes.hpp"
#include "map_file/map_file.hpp"
#include "map_file/open_map.hpp"
#include "system/dense_beside.hpp"
#include "system/map_merge.hpp"
#include "system/run_writer.hpp"
#include "system/slam_config.hpp"

namespace ygslam {
namespace {

constexpr Rgb8 kLandmarkColour{200, 200, 200};
constexpr int kStampDecimals = 6;

/// Rooms that look alike agree over a room: what spans less proves nothing by itself.
constexpr double kProvingExtent_m = 8;

struct MapOptions {
  std::string file, other;
  std::string out;
  bool same_place = false;  ///< the user says so
  bool json = false;
};

/// What lies beside the map, or why it is no dense map of this one; nothing without a file.
std::optional<Result<DenseFileInfo>> dense_info(const std::filesystem::path& map,
                                                const std::string& uuid) {
  const auto file = dense_file_of(map);
  std::error_code code;
  if (!std::filesystem::exists(file, code)) return std::nullopt;
  auto info = read_dense_info(file);
  if (!info.ok()) return info;
  if (const auto foreign = foreign_text(*info, parse_identity(uuid)); !foreign.empty())
    return Error{ErrorKind::kSavedMap, file.string() + ": " + foreign};
  return info;
}

/// What nobody asked for is not made, and what is another map's stays.
void tell_of_dense_at(const std::string& new_map) {
  const auto info = read_map_info(new_map);
  const auto dense = dense_info(new_map, info.ok() ? info->uuid : "");
  if (dense && !dense->ok())
    print_text("{}; it stays as it is\n", one_line(dense->error().message));
}

nlohmann::ordered_json json_of(const MapFileInfo& info) {
  nlohmann::ordered_json json;
  json["uuid"] = info.uuid;
  json["created"] = info.created;
  json["program_version"] = info.program_version;
  json["generation"] = info.generation;
  const CameraConfig& c = info.camera;
  json["camera"] = {{"width", c.width}, {"height", c.height}, {"fx", c.fx}, {"fy", c.fy},
                    {"cx", c.cx},       {"cy", c.cy},         {"k1", c.k1}, {"k2", c.k2},
                    {"p1", c.p1},       {"p2", c.p2},         {"k3", c.k3}};
  json["pyramid"] = {{"levels", info.pyramid_levels}, {"factor", info.pyramid_factor}};
  json["keyframes"] = info.keyframes;
  json["removed_keyframes"] = info.removed_keyframes;
  json["landmarks"] = info.landmarks;
  json["observations"] = info.observations;
  json["bytes"] = info.bytes;
  return json;
}

Result<int> show(const MapOptions& options) {
  const auto info = read_map_info(options.file);
  if (!info) return info.error();
  const auto dense = dense_info(options.file, info->uuid);
  if (options.json) {
    nlohmann::ordered_json json = json_of(*info);
    if (dense && dense->ok()) {
      json["dense"] = {{"views", (*dense)->views}, {"bytes", (*dense)->bytes}};
      json["dense"]["names_map"] = (*dense)->map.has_value();
    } else if (dense) {
      json["dense"] = {{"fault", dense->error().message}};
    }
    print_text(json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    return 0;
  }
  const CameraConfig& c = info->camera;
  std::printf("keyframes     %llu (and the poses of %llu removed)\n",
              static_cast<unsigned long long>(info->keyframes),
              static_cast<unsigned long long>(info->removed_keyframes));
  std::printf("landmarks     %llu, observed %llu times\n",
              static_cast<unsigned long long>(info->landmarks),
              static_cast<unsigned long long>(info->observations));
  std::printf("camera        %dx%d, fx %g fy %g cx %g cy %g", c.width, c.height, c.fx, c.fy, c.cx,
              c.cy);
  if (c.is_distorted())
    std::printf(", k1 %g k2 %g p1 %g p2 %g k3 %g", c.k1, c.k2, c.p1, c.p2, c.k3);
  std::printf("\npyramid       %d levels, factor %g\n", info->pyramid_levels, info->pyramid_factor);
  std::printf("file          %.1f MB, written %llu times, created %s, by version %s\n",
              static_cast<double>(info->bytes) * 1e-6,
              static_cast<unsigned long long>(info->generation), printable(info->created).c_str(),
              printable(info->program_version).c_str());
  std::printf("uuid          %s\n", printable(info->uuid).c_str());
  if (dense && dense->ok()) {
    std::printf("dense map     %llu views, %.1f MB beside it%s\n",
                static_cast<unsigned long long>((*dense)->views),
                static_cast<double>((*dense)->bytes) * 1e-6,
                (*dense)->map ? "" : " (it does not say of which map; `map check` looks)");
  } else if (dense) {
    print_text("dense map     none that can be used: {}\n", one_line(dense->error().message));
  }
  return 0;
}

void print_faults(const MapCheck& check) {
  for (const std::string& fault : check.faults) print_text("{}\n", one_line(fault));
  if (check.faults_in_all > check.faults.size())
    std::printf("and %llu more\n",
                static_cast<unsigned long long>(check.faults_in_all - check.faults.size()));
}

/// That it is whole, and of a map that is whole.
Status check_dense(const std::filesystem::path& file, const std::string& map_file,
                   const MapFileInfo& info) {
  const Camera camera(info.camera);
  const auto map = load_map(map_file);
  if (!map.ok()) {
    const auto views = load_dense_views(file, camera);
    return views.ok() ? Status(Ok{}) : views.error();
  }
  const auto beside = load_dense_beside(file, *map, camera);
  if (!beside.ok()) return beside.error();
  if (beside->foreign.empty()) return Ok{};
  return Error{ErrorKind::kSavedMap, file.string() + ": " + beside->foreign};
}

Result<int> check(const MapOptions& options) {
  const auto checked = check_map(options.file);
  if (!checked) return checked.error();
  std::error_code code;
  if (const auto file = dense_file_of(options.file); std::filesystem::exists(file, code)) {
    if (Status fits = check_dense(file, options.file, checked->info); !fits.ok())
      return fits.error();
  }
  if (checked->faults_in_all == 0) {
    print_text("{}: whole: {}, {}\n", one_line(options.file),
               counted(checked->info.keyframes, "keyframe"),
               counted(checked->info.landmarks, "landmark"));
    return 0;
  }
  print_text("{}: damaged, what is wrong in it:\n", one_line(options.file));
  print_faults(*checked);
  return Error{ErrorKind::kSavedMap,
               options.file + ": damaged: " + counted(checked->faults_in_all, "fault") +
                   "; `ygslam map recover " + options.file + " -o NEW.map` saves what is good"};
}

/// A new map is none of those it is made of, nor what lies beside them.
Status check_new_map(const MapOptions& options) {
  FileUses uses;
  uses.reads_map("FILE", options.file);
  uses.reads_map("OTHER", options.other);
  uses.writes_map("--out", options.out);
  return uses.check();
}

Result<int> recover(const MapOptions& options) {
  if (Status checked = check_new_map(options); !checked.ok()) return checked.error();
  const auto recovered = recover_map(options.file, options.out);
  if (!recovered) return recovered.error();
  print_faults(recovered->found);
  const MapFileInfo& before = recovered->found.info;
  print_text("{}: {} of {} keyframes, {} of {} landmarks, {} of {} observations\n",
             one_line(options.out), recovered->keyframes, before.keyframes, recovered->landmarks,
             before.landmarks, recovered->observations, before.observations);
  std::error_code code;
  if (const auto dense = dense_file_of(options.file); std::filesystem::exists(dense, code))
    print_text("{}: not recovered, {} has no dense map\n", one_line(dense.string()),
               one_line(options.out));
  tell_of_dense_at(options.out);
  return 0;
}

Result<int> export_map(const MapOptions& options) {
  const std::filesystem::path out = options.out;
  const bool cloud = out.extension() == ".ply";
  if (!cloud && out.extension() != ".txt")
    return Error{ErrorKind::kUsage,
                 options.out + ": .ply for landmarks or .txt for the keyframes' trajectory"};
  std::error_code code;
  if (std::filesystem::is_regular_file(out, code) && map_file::has_map_header(out))
    return Error{ErrorKind::kOutput, options.out + ": is a map: not replaced"};
  FileUses uses;
  uses.reads_map("FILE", options.file);
  uses.writes("--out", options.out);
  if (Status checked = uses.check(); !checked.ok()) return checked.error();
  const auto map = load_map(options.file);
  if (!map) return map.error();
  if (cloud) {
    std::map<LandmarkId, ColouredPoint> sorted;  // the same map gives the same file
    map->for_each_landmark([&](const Landmark& landmark) {
      sorted[landmark.id] = {landmark.p_world.cast<float>(), kLandmarkColour};
    });
    std::vector<ColouredPoint> points;
    for (const auto& [id, point] : sorted)
      if (point.p_world.allFinite()) points.push_back(point);  // not beyond what a float holds
    if (Status written = write_ply(out, points); !written) return written.error();
    tell_written(options.out);
    return 0;
  }
  const std::string poses = format_tum(keyframe_trajectory(*map), kStampDecimals);
  if (Status written = write_file_atomically(out, poses); !written) return written.error();
  tell_written(options.out);
  return 0;
}

Result<int> merge(const MapOptions& options) {
  const auto info = read_map_info(options.file);
  if (!info) return info.error();
  const auto a = load_map(options.file);
  if (!a) return a.error();
  const Camera camera(info->camera);
  const auto b = load_map(options.other, camera, a->scales());
  if (!b) return b.error();
  if (a->version() == b->version() && to_bytes(*a) == to_bytes(*b))
    return Error{ErrorKind::kUsage, options.other + ": the same map as " + options.file};
  if (Status checked = check_new_map(options); !checked.ok()) return checked.error();
  const auto config = resolved(SlamConfig{});
  if (!config) return config.error();
  const MapAlignment alignment =
      align_maps(*a, *b, camera, {config->loop.index, config->loop.finder});
  print_text("{} observations of {} in {}; {} agree, {} of them independent, over {:.1f} m\n",
             alignment.found, one_line(options.other), one_line(options.file),
             alignment.pairs.size(), alignment.independent, alignment.extent_m);
  const auto refuse = [&](const std::string& why) {
    return Error{ErrorKind::kSavedMap, options.other + ": " + why + "; nothing was written"};
  };
  if (alignment.outcome == MapAlignment::Outcome::kNoOverlap)
    return refuse("too few independent observations of " + options.file);
  if (alignment.outcome == MapAlignment::Outcome::kAmbiguous)
    return refuse("ambiguous, it fits " + options.file + " in two ways");
  if (!options.same_place && alignment.extent_m < kProvingExtent_m)
    return refuse(
        "what both maps show spans less than 8 m and another room may look the same: "
        "--same-place if it is this one");
  Map merged = merge_maps(*a, *b, alignment, camera, config->mapping);
  merged.set_identity(random_identity());
  if (Status written = save_map(options.out, merged, camera); !written) return written.error();
  print_text("{}: {}, {}\n", one_line(options.out), counted(merged.keyframes().size(), "keyframe"),
             counted(merged.landmark_count(), "landmark"));
  tell_of_dense_at(options.out);
  return 0;
}

}  // namespace

void add_map_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<MapOptions>();
  CLI::App* command =
      app.add_subcommand("map", "Look into map files, check, repair and merge them");
  command->require_subcommand(1);
  command->fallthrough();
  const auto add = [&](const char* name, const char* what, Result<int> (*work)(const MapOptions&)) {
    CLI::App* sub = command->add_subcommand(name, what);
    sub->fallthrough();
    sub->add_option("FILE", options->file, "The map")->required()->type_name("");
    sub->callback([options, work, &exit_code] { exit_code = exit_code_of(work(*options)); });
    return sub;
  };
  add("info", "Camera, size and age of a map, without reading it all", show)
      ->add_flag("--json", options->json, "As JSON");
  add("check", "Read all of it and name every fault; code 6 if there is one", check);
  add("recover", "Write what is good of a damaged map to a new file", recover)
      ->add_option("-o,--out", options->out, "New map; must not be there yet")
      ->required()
      ->type_name("NEW");
  add("export", "Landmarks as a point cloud, or the keyframes' poses", export_map)
      ->add_option("-o,--out", options->out,
                   "NAME.ply: landmarks; NAME.txt: poses of the keyframes in TUM format")
      ->required()
      ->type_name("FILE");
  CLI::App* merging = add("merge", "Make one map of two that show some of the same places", merge);
  merging->add_option("OTHER", options->other, "The map to add; the frame of the first stays")
      ->required()
      ->type_name("");
  merging->add_option("-o,--out", options->out, "New map")->required()->type_name("NEW");
  merging->add_flag("--same-place", options->same_place,
                    "Believe a small overlap: no other room looks the same");
  command->footer(
      "Examples:\n"
      "  ygslam map info room.map\n"
      "  ygslam map check room.map\n"
      "  ygslam map recover room.map -o rescued.map\n"
      "  ygslam map export room.map -o room.ply\n"
      "  ygslam map export room.map -o keyframes.txt\n"
      "  ygslam map merge monday.map tuesday.map -o both.map\n"
      "A map is one file; where a run was killed its log FILE-wal belongs to it: move both.\n"
      "Codes: 0 done, 2 usage, 6 damaged, no map, of another format or not to be merged, 9 output "
      "not writable,\n141 (of info, check) its reader left (| head).\n"
      "See docs/maps.md.");
}

}  // namespace ygslam
