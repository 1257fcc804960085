#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "io/calibration.hpp"
#include "io/camera_formats.hpp"
#include "io/depth_calibration.hpp"
#include "system/camera_yaml.hpp"

namespace ygslam::fuzz {
namespace {

void check(CameraConfig camera) {
  if (camera.width <= 0) camera.width = 640;
  if (camera.height <= 0) camera.height = 480;
  if (!camera_faults(camera).empty()) return;
  // The same lens with fewer pixels: every one of them is undone.
  const double scale = std::min(1.0, 40.0 / std::max(camera.width, camera.height));
  for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value *= scale;
  camera.width = std::max(1, static_cast<int>(scale * camera.width));
  camera.height = std::max(1, static_cast<int>(scale * camera.height));
  if (!camera_faults(camera).empty()) return;
  // Nothing that is accepted has a pixel without a ray, or one far from all others.
  const Camera made(camera);
  const auto& bounds = made.ideal_bounds();
  for (const double bound : bounds) CHECK(std::isfinite(bound) && std::abs(bound) < 1e6);
  for (int v = 0; v < made.height(); ++v) {
    for (int u = 0; u < made.width(); ++u) {
      const Vec2 uv_px(u, v);
      CHECK((made.distort(made.undistort(uv_px)) - uv_px).norm() < 0.1);
    }
  }
}

}  // namespace

void calibration(std::string_view bytes) {
  const auto text = parse_calibration(bytes, "calibration.txt");
  if (text.ok()) check(*text);
  if (const auto foreign = parse_foreign_camera(bytes, "camera"); foreign && foreign->ok())
    CHECK(!(*foreign)->taken_for.empty());
  const auto yaml = parse_camera_yaml(std::string(bytes), "camera.yaml");
  if (yaml.ok()) check(*yaml);
  const auto depth = parse_depth_calibration(std::string(bytes), "calibration_depth.txt");
  if (!depth.ok()) return;
  check(depth->camera);
  CHECK(std::abs(depth->T_colour_depth.R().determinant() - 1) < 1e-6);
  CHECK(parse_depth_calibration(format_depth_calibration(*depth), "again").ok());
}

}  // namespace ygslam::fuzz
