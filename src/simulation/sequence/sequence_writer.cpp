#include "simulation/sequence/sequence_writer.hpp"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <system_error>

#include "image/depth.hpp"
#include "io/calibration.hpp"
#include "io/depth_calibration.hpp"
#include "io/image_file.hpp"
#include "io/inner_folder.hpp"
#include "io/trajectory.hpp"
#include "simulation/sequence/inertial_files.hpp"

namespace ygslam::sim {

namespace fs = std::filesystem;

namespace {

constexpr std::array kLists = {
    "rgb.txt",         "depth.txt",  "associations.txt", "groundtruth.txt", "calibration.txt",
    kDepthCalibration, kImuReadings, kImuPlace,          kWheelPoses,       kWheelPlace};

Error cannot_write(const fs::path& path, int code) {
  return {ErrorKind::kOutput, path.string() + ": " + std::strerror(code)};
}

/// Stamp with six decimals, exact.
std::string stamp_text(Timestamp stamp) {
  const std::int64_t us = stamp.ns / 1000;
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%lld.%06lld", static_cast<long long>(us / 1'000'000),
                static_cast<long long>(us % 1'000'000));
  return text.data();
}

double depth_scale(const SequenceSource& source) {
  return source.depth_camera() ? source.depth_camera()->camera.depth_scale
                               : source.camera().config().depth_scale;
}

std::string cut_short(const std::string& bytes, bool truncate) {
  return truncate ? bytes.substr(0, bytes.size() * 3 / 5) : bytes;
}

}  // namespace

Status write_new_file(const fs::path& path, const std::string& bytes) {
  std::error_code ignored;
  fs::remove(path, ignored);  // a link in its place would be written through
  std::FILE* file = std::fopen(path.c_str(), "wbx");
  if (file == nullptr) return cannot_write(path, errno);
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  int code = errno;
  if (std::fclose(file) != 0 && written)
    code = errno;
  else if (written)
    return Ok{};
  fs::remove(path, ignored);
  return cannot_write(path, code);
}

Status SequenceWriter::put(const fs::path& name, const std::string& bytes) const {
  return write_new_file(folder_ / name, bytes);
}

Result<SequenceWriter> SequenceWriter::create(const fs::path& folder,
                                              const SequenceSource& /*source*/,
                                              const WriteOptions& options) {
  SequenceWriter writer(folder, options);
  std::vector<const char*> folders = {"rgb", "depth"};
  if (options.truth)
    folders.insert(folders.end(), {"mask", "things", "moving", "depth_true", "rgb_static",
                                   "depth_static", "movers"});
  for (const char* name : folders)
    if (Status checked = check_inner_folder(folder, name); !checked.ok()) return checked.error();
  std::error_code error;
  // Lists are written at the end of a rendering, with simulation.json beside them.
  if (!fs::exists(folder / "simulation.json", error)) {
    for (const char* list : kLists)
      if (fs::exists(folder / list, error))
        return Error{ErrorKind::kOutput, folder.string() +
                                             ": holds a recording that was not "
                                             "rendered (" +
                                             list + "); it is left as it is"};
  }
  // Truth of an earlier rendering would be taken for that of this one.
  if (fs::exists(folder / "simulation.json", error)) {
    for (const char* name :
         {"mask", "things", "moving", "depth_true", "rgb_static", "depth_static", "movers",
          "instances.json", "true_objects.json", "static.ply", kImuTruth}) {
      fs::remove_all(folder / name, error);
      if (error)
        return Error{ErrorKind::kOutput, (folder / name).string() + ": " + error.message()};
    }
  }
  for (const char* name : folders)
    if (Status made = make_inner_folder(folder, name); !made.ok()) return made.error();
  for (const char* list : kLists) {
    fs::remove(folder / list, error);
    if (error) return Error{ErrorKind::kOutput, (folder / list).string() + ": " + error.message()};
  }
  return writer;
}

Status SequenceWriter::add_truth(const SimulatedFrame& frame, const std::string& stamp) {
  const double scale = 5000;
  const std::string png = stamp + ".png";
  for (const auto& [name, bytes] :
       {std::pair<std::string, std::string>{"mask/" + png,
                                            encode_png(frame.ids, 1, PngFilter::kUp)},
        {"things/" + png, encode_png(frame.things, 1, PngFilter::kUp)},
        {"moving/" + png, encode_png(frame.moving, 1, PngFilter::kUp)},
        {"depth_true/" + png,
         encode_png(raw_from_depth(frame.depth_true_m, scale), 1, PngFilter::kUp)},
        {"rgb_static/" + stamp + (options_.jpeg ? ".jpg" : ".png"),
         options_.jpeg ? encode_jpeg(frame.rgb_static, 95) : encode_png(frame.rgb_static, 1)},
        {"depth_static/" + png,
         encode_png(raw_from_depth(frame.depth_static_m, scale), 1, PngFilter::kUp)}}) {
    if (Status status = put(name, bytes); !status) return status;
  }
  return Ok{};
}

Status SequenceWriter::add(const SimulatedFrame& frame, const SequenceSource& source) {
  const Delivery& delivery = frame.delivery;
  if (!delivery.frame) return Ok{};
  const std::string stamp = stamp_text(frame.frame->stamp);
  const std::string colour_file = "rgb/" + stamp + (options_.jpeg ? ".jpg" : ".png");
  const std::string depth_file = "depth/" + stamp + ".png";
  if (delivery.colour) {
    const std::string bytes =
        options_.jpeg ? encode_jpeg(frame.frame->colour, 95) : encode_png(frame.frame->colour, 1);
    if (Status status = put(colour_file, cut_short(bytes, delivery.truncate_colour)); !status)
      return status;
    colour_list_ += stamp + " " + colour_file + "\n";
  }
  if (delivery.depth) {
    const std::string bytes =
        encode_png(raw_from_depth(frame.frame->depth_m, depth_scale(source)), 1,
                   PngFilter::kNone);  // the sensor's steps repeat: best as they are
    if (Status status = put(depth_file, cut_short(bytes, delivery.truncate_depth)); !status)
      return status;
    depth_list_ += stamp + " " + depth_file + "\n";
  }
  if (delivery.colour && delivery.depth)
    pairs_ += stamp + " " + colour_file + " " + stamp + " " + depth_file + "\n";
  poses_ += format_tum({frame.frame->stamp, frame.T_world_camera}, 6);
  if (!options_.truth) return Ok{};
  for (const auto& [name, T_world_object] : source.mover_poses(frame.t_s)) {
    mover_poses_[name] += format_tum({frame.frame->stamp, T_world_object}, 6);
  }
  objects_.add(source.scene(), frame.t_s, frame.frame->stamp,
               {frame.things, frame.depth_true_m, source.camera(), frame.T_world_camera});
  return add_truth(frame, stamp);
}

Status SequenceWriter::finish(const SequenceSource& source) {
  if (options_.truth) {
    nlohmann::json instances = nlohmann::json::object();
    for (const auto& [id, name] : source.instance_classes()) instances[std::to_string(id)] = name;
    std::vector<std::pair<std::string, std::string>> files = {
        {"instances.json", instances.dump(2) + "\n"},
        {"things/instances.json", thing_names_json(source.scene())},
        {"true_objects.json", objects_.json(source.scene())},
        {"static.ply", static_mesh_ply(source.scene())}};
    for (const Mover& mover : source.scene().movers) {
      files.emplace_back("movers/" + std::to_string(mover.instance_id) + ".txt",
                         "# " + mover.name + "\n" + mover_poses_[mover.name]);
    }
    for (const auto& [name, bytes] : files) {
      if (Status status = put(name, bytes); !status) return status;
    }
  }
  CameraConfig camera = source.camera().config();
  camera.shutter_known = true;
  std::vector<std::pair<const char*, std::string>> lists = {
      {"rgb.txt", "# colour images\n" + colour_list_},
      {"depth.txt", "# depth images\n" + depth_list_},
      {"associations.txt", pairs_},
      {"groundtruth.txt", "# timestamp tx ty tz qx qy qz qw\n" + poses_},
      {"calibration.txt", "# made by ygslam simulate\n" + format_calibration(camera)}};
  if (source.depth_camera())
    lists.emplace_back(kDepthCalibration, format_depth_calibration(*source.depth_camera()));
  for (const auto& [name, text] : lists) {
    if (Status status = put(name, text); !status) {
      std::error_code ignored;
      for (const char* list : kLists) fs::remove(folder_ / list, ignored);
      return status;
    }
  }
  return Ok{};
}

std::string static_mesh_ply(const Scene& scene) {
  const Mesh& mesh = scene.fixed;
  std::string ply =
      "ply\nformat binary_little_endian 1.0\ncomment fixed scene, metres, z up\nelement vertex " +
      std::to_string(mesh.points.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar "
      "green\nproperty uchar blue\nelement face " +
      std::to_string(mesh.triangles.size()) +
      "\nproperty list uchar int vertex_indices\nend_header\n";
  std::vector<Rgb8> colours(mesh.points.size());
  for (const Triangle& triangle : mesh.triangles) {
    const Material& material = scene.materials.material(triangle.material);
    const Vec3f mean =
        scene.materials.texture(material.frames[0]).mean().cwiseProduct(material.tint);
    const auto code = [](float v) {
      return static_cast<std::uint8_t>(std::min(255.0F, 255 * std::sqrt(v)));
    };
    for (const std::uint32_t corner : triangle.corner)
      colours[corner] = {code(mean.x()), code(mean.y()), code(mean.z())};
  }
  const auto raw = [&](const auto& value) {
    ply.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    for (int k = 0; k < 3; ++k) raw(mesh.points[i][k]);
    raw(colours[i].r);
    raw(colours[i].g);
    raw(colours[i].b);
  }
  for (const Triangle& triangle : mesh.triangles) {
    raw(std::uint8_t{3});
    for (const std::uint32_t corner : triangle.corner) raw(static_cast<std::int32_t>(corner));
  }
  return ply;
}

}  // namespace ygslam::sim
