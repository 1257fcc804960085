#include "app/commands.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>

#include "app/exit_code.hpp"
#include "app/file_uses.hpp"
#include "app/option_checks.hpp"
#include "app/program_log.hpp"
#include "app/scene_input.hpp"
#include "core/log.hpp"
#include "io/atomic_file.hpp"
#include "io/image_file.hpp"
#include "io/trajectory_formats.hpp"
#include "scene_picture/annotate.hpp"

namespace ygslam {
namespace {

struct RenderArguments {
  std::string scene, other, out, path;
  std::string by = "colour", size = "1280x960";
  std::string from, look_at, up;
  std::optional<double> cut_m;
  double point_m = PictureStyle{}.point_m;
  bool boxes = false;
};

// What the arguments say, read and checked.
struct Job {
  int width = 0, height = 0;
  std::optional<Vec3> from, look_at, up;
  PictureStyle style;
  bool has_cut = false;  // asked for
  std::vector<StampedPose> path;
};

constexpr int kLargestSide_px = 16384;
constexpr double kFocal = 0.86;  // of the width: 60 degrees from side to side
constexpr Rgb8 kPathColour{220, 30, 30};
constexpr double kRoom_m = 2.3;  // so high a scene has a ceiling, which hides the rest from above
constexpr double kCutOver_m = 2.0;  // over the floor, where nothing else was asked for

Error bad_option(const std::string& what) { return {ErrorKind::kUsage, what}; }

Result<std::optional<Vec3>> parse_vector(const std::string& option, const std::string& text) {
  if (text.empty()) return std::optional<Vec3>{};
  Vec3 v;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &v[0], &v[1], &v[2], &rest) != 3 || !v.allFinite())
    return bad_option(option + ": wants three numbers x,y,z, not '" + text + "'");
  return std::optional<Vec3>(v);
}

PictureColour colour_by(const std::string& name) {
  if (name == "class") return PictureColour::kClass;
  if (name == "object") return PictureColour::kObject;
  if (name == "height") return PictureColour::kHeight;
  return PictureColour::kSurface;
}

Status read_places(const RenderArguments& a, Job& job) {
  for (const auto& [option, text, value] :
       {std::tuple{"--from", &a.from, &job.from}, std::tuple{"--look-at", &a.look_at, &job.look_at},
        std::tuple{"--up", &a.up, &job.up}}) {
    auto parsed = parse_vector(option, *text);
    if (!parsed.ok()) return parsed.error();
    *value = *parsed;
  }
  if (job.from.has_value() != job.look_at.has_value())
    return bad_option("--from and --look-at belong together");
  if (job.from && (*job.from - *job.look_at).norm() < 1e-6)
    return bad_option("--look-at: is the place of --from");
  if (job.up && job.up->norm() < 1e-6) return bad_option("--up: has no direction");
  return Ok{};
}

Result<Job> read_job(const RenderArguments& a) {
  Job job;
  char rest = 0;
  if (std::sscanf(a.size.c_str(), "%dx%d%c", &job.width, &job.height, &rest) != 2 ||
      job.width < 16 || job.height < 16 || std::max(job.width, job.height) > kLargestSide_px)
    return bad_option("--size wants WIDTHxHEIGHT, 16 to 16384 each, not '" + a.size + "'");
  if (!a.out.ends_with(".png")) return bad_option("--out " + a.out + ": the name must end in .png");
  if (!std::isfinite(a.point_m)) return bad_option("--point wants a length in metres");
  if (Status places = read_places(a, job); !places.ok()) return places.error();
  job.style.colour = colour_by(a.by);
  job.style.point_m = a.point_m;
  job.has_cut = a.cut_m.has_value();
  if (a.cut_m) job.style.cut_above_m = *a.cut_m;
  if (!a.path.empty()) {
    const auto trajectory = read_trajectory(a.path);
    if (!trajectory.ok()) return trajectory.error();
    job.path = trajectory->poses;
  }
  return job;
}

Result<SceneInput> read_scene(const std::string& path, const Job& job) {
  auto scene = read_scene_input(path);
  if (!scene.ok()) return scene;
  if (scene->mesh.vertices.empty()) log::warn("{}: nothing in it to draw", path);
  const bool uses_heights = job.style.colour == PictureColour::kHeight || job.has_cut;
  if (!job.up && !scene->gravity.has_floor && uses_heights)
    log::warn(
        "{}: no floor was found in it: heights are along -y of the file (up in the first camera's "
        "view) from the lowest point; --up X,Y,Z says what is up, and a run's --export finds it",
        path);
  if (job.up) {
    scene->gravity.up_world = job.up->normalized();
    scene->gravity.floor_m = lowest_height(scene->mesh, scene->gravity.up_world);
  }
  return scene;
}

/// Where the whole scene is seen from above and nothing else was asked for, what is over the heads
/// of people is left out.
double cut_from_above_m(const SceneInput& scene) {
  const double top_m = -lowest_height(scene.mesh, -scene.gravity.up_world) - scene.gravity.floor_m;
  return top_m > kRoom_m ? kCutOver_m : PictureStyle{}.cut_above_m;
}

std::vector<Vec3> places(const std::vector<StampedPose>& path) {
  std::vector<Vec3> places_world;
  for (const StampedPose& pose : path) places_world.push_back(pose.T_world_camera.t());
  return places_world;
}

Viewpoint viewpoint_of(const Job& job, const SceneInput& scene, bool boxes) {
  if (!job.from) {
    Overview options;
    options.width = job.width;
    options.height = job.height;
    if (std::isfinite(job.style.cut_above_m)) options.cut_above_m = job.style.cut_above_m;
    options.also_world = places(job.path);
    const auto corners = boxes ? box_corners(scene.objects) : std::vector<Vec3>();
    options.also_world.insert(options.also_world.end(), corners.begin(), corners.end());
    return overview(scene.mesh.vertices, scene.gravity, options);
  }
  Viewpoint view;
  view.width = job.width;
  view.height = job.height;
  view.focal_px = kFocal * job.width;
  view.T_camera_world = look_at(*job.from, *job.look_at, scene.gravity.up_world);
  return view;
}

ScenePicture draw(const Job& job, const SceneInput& scene, const Viewpoint& view, bool boxes) {
  const bool is_cloud = scene.mesh.triangles.empty();
  ScenePicture picture =
      is_cloud ? draw_points(scene.mesh.vertices, view, scene.gravity, job.style, scene.objects)
               : draw_mesh(scene.mesh, view, scene.gravity, job.style, scene.objects);
  if (boxes) draw_boxes(picture.image, scene.objects, view, job.style.colour);
  return picture;
}

/// One scene, or two of them beside each other from the same viewpoint.
class Picture {
 public:
  static Result<Picture> open(const RenderArguments& a, const Job& job) {
    Picture picture(a, job);
    for (const std::string& path : {a.scene, a.other}) {
      if (path.empty()) continue;
      auto scene = read_scene(path, job);
      if (!scene.ok()) return scene.error();
      if (a.boxes && !scene->has_objects)
        return Error{ErrorKind::kInput,
                     path + ": has no objects.json beside it, which --boxes draws"};
      picture.scenes_.push_back(std::move(*scene));
    }
    picture.scenes_.back().gravity = picture.scenes_.front().gravity;  // one light, one cut
    return picture;
  }
  [[nodiscard]] const SceneInput& scene() const { return scenes_.front(); }
  /// @param path to be drawn; may be empty.
  [[nodiscard]] ColourImage draw(const Viewpoint& view, std::span<const Vec3> path_world) const {
    std::vector<ColourImage> images;
    for (const SceneInput& scene : scenes_) {
      ScenePicture picture = ygslam::draw(job_, scene, view, arguments_.boxes);
      draw_path(picture.image, path_world, view, kPathColour);
      images.push_back(with_legend(picture));
    }
    if (images.size() == 1) return images.front();
    return side_by_side(std::array{CaptionedImage{&images[0], arguments_.scene},
                                   CaptionedImage{&images[1], arguments_.other}});
  }

 private:
  Picture(const RenderArguments& a, const Job& job) : arguments_(a), job_(job) {}
  const RenderArguments& arguments_;
  const Job& job_;
  std::vector<SceneInput> scenes_;
};

Status check_picture_files(const RenderArguments& a) {
  FileUses uses;
  uses.reads("SCENE", a.scene);
  uses.reads("--side-by-side", a.other);
  uses.reads("--path", a.path);
  uses.writes("--out", a.out);
  return uses.check();
}

Status render(const RenderArguments& a) {
  if (Status checked = check_picture_files(a); !checked.ok()) return checked;
  auto job = read_job(a);
  if (!job.ok()) return job.error();
  const auto picture = Picture::open(a, *job);
  if (!picture.ok()) return picture.error();
  if (!a.cut_m && !job->from) job->style.cut_above_m = cut_from_above_m(picture->scene());
  const ColourImage image =
      picture->draw(viewpoint_of(*job, picture->scene(), a.boxes), places(job->path));
  Status written = write_file_atomically(a.out, encode_png(image, 9));
  if (written.ok()) tell_written(a.out);
  return written;
}

void declare_options(CLI::App& command, RenderArguments& a) {
  command.add_option("SCENE", a.scene, "mesh.ply, cloud.ply or map.ply, or the folder it lies in")
      ->required()
      ->type_name("FILE|DIR");
  command.add_option("--out", a.out, "The picture")->required()->type_name("FILE.png");
  command
      .add_option(
          "--by", a.by,
          "What colours tell: the surface's own colour, its class, its object or the height "
          "over the floor")
      ->check(CLI::IsMember({"colour", "class", "object", "height"}))
      ->type_name("NAME")
      ->capture_default_str();
  command
      .add_option("--side-by-side", a.other, "A second scene beside it, from the same viewpoint")
      ->type_name("FILE|DIR");
  command
      .add_option("--path", a.path,
                  "The way of a camera (trajectory.txt of the same run): drawn into the picture")
      ->type_name("FILE");
  command.add_flag(
      "--boxes", a.boxes,
      "Draw boxes and names of what objects.json says is there (no candidates), in the "
      "colours of --by class, else in those of objects");
  command.add_option("--from", a.from, "Place of the eye in the file's frame [m]")
      ->type_name("X,Y,Z");
  command.add_option("--look-at", a.look_at, "What it looks at [m]")->type_name("X,Y,Z");
  command
      .add_option(
          "--up", a.up,
          "What is up; else as objects.json beside the file has it, as the floor lies, or -y "
          "(up in the first camera's view)")
      ->type_name("X,Y,Z");
  command
      .add_option("--cut", a.cut_m,
                  "Leave out the ceiling and what is higher over the floor [m]; without --from 2 "
                  "in a scene that is higher than 2.3; inf: leave out nothing")
      ->check(in_range(0.0, std::numeric_limits<double>::infinity()))
      ->type_name("M");
  command.add_option("--point", a.point_m, "Side of a point of a cloud [m]")
      ->check(in_range(0.0, 1.0))
      ->type_name("M")
      ->capture_default_str();
  command.add_option("--size", a.size, "Size of the picture (of each of two)")
      ->type_name("WxH")
      ->capture_default_str();
}

constexpr const char* kRenderFooter =
    "No display is needed. Without --from the whole scene is seen from above at an angle; "
    "surfaces\n"
    "seen from behind are left out, so that one looks through the ceiling and the nearest walls.\n"
    "Examples:\n"
    "  ygslam run SEQ --out out --export scene && ygslam render scene --out room.png\n"
    "  ygslam render scene --by class --out classes.png          # with a legend\n"
    "  ygslam render scene --by object --boxes --cut 2 --out things.png\n"
    "  ygslam render scene --path out/trajectory.txt --out way.png\n"
    "  ygslam render out/map.ply --point 0.04 --up 0,-1,-0.5 --by height --out landmarks.png\n"
    "  ygslam render clean --side-by-side raw --from 0,-1,-1 --look-at 0,0,3 --out fig9.png\n"
    "Exit codes: 0 ok, 2 usage, 4 a file that cannot be used, 9 picture not written.";

}  // namespace

void add_render_command(CLI::App& app, int& exit_code) {
  const auto arguments = std::make_shared<RenderArguments>();
  CLI::App* command = app.add_subcommand("render", "Draw a mesh or a cloud as a PNG");
  declare_options(*command, *arguments);
  command->footer(kRenderFooter);
  command->callback([arguments, &exit_code] { exit_code = exit_code_of(render(*arguments)); });
}

}  // namespace ygslam
