#include "io/fusion_info.hpp"

#include <map>
#include <vector>

#include "io/calibration.hpp"
#include "io/camera_matrix.hpp"
#include "io/depth_calibration.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
using Values = std::map<std::string, std::vector<double>, std::less<>>;

/// The numbers behind each key; a value that is no list of numbers is empty.
Values values_of(std::string_view text) {
  Values values;
  for (const TextLine& line : data_lines(text)) {
    const std::size_t equals = line.text.find('=');
    if (equals == std::string_view::npos) continue;
    auto& numbers = values[std::string(trimmed(line.text.substr(0, equals)))];
    numbers.clear();
    for (const std::string_view word : words_of(line.text.substr(equals + 1))) {
      const auto number = parse_number(word);
      if (!number) {
        numbers.clear();
        break;
      }
      numbers.push_back(*number);
    }
  }
  return values;
}

std::optional<Matrix4> matrix_of(const Values& values, std::string_view key) {
  const auto found = values.find(key);
  if (found == values.end() || found->second.size() != 16) return std::nullopt;
  return Matrix4(Eigen::Map<const Matrix4>(found->second.data()));
}

/// @param kind "Color" or "Depth". @return kConfig without the file's name where it is damaged.
Result<CameraConfig> lens_of(const Values& values, const std::string& kind) {
  const std::string matrix = "m_calibration" + kind + "Intrinsic";
  const auto refuse = [](const std::string& what) { return Error{ErrorKind::kConfig, what}; };
  const auto K = matrix_of(values, matrix);
  if (!K) return refuse(matrix + ": is no 4x4 matrix");
  CameraConfig camera;
  if (const auto fault = set_camera_matrix(camera, {K->data(), 16}); !fault.empty())
    return refuse(matrix + ": " + fault);
  const auto number = [&](const std::string& key, double otherwise) {
    const auto found = values.find(key);
    return found != values.end() && found->second.size() == 1 ? found->second.front() : otherwise;
  };
  const auto side = [&](const std::string& key) {
    const double px = number("m_" + std::string(kind == "Color" ? "color" : "depth") + key, 0);
    return px >= 1 && px <= kMaxImageSide_px ? static_cast<int>(px) : 0;
  };
  camera.width = side("Width");
  camera.height = side("Height");
  camera.depth_scale = number("m_depthShift", 1000);
  if (!(camera.depth_scale > 0)) return refuse("m_depthShift: must be above 0");
  if (const auto faults = camera_faults(camera); !faults.empty())
    return refuse(matrix + ": " + faults.front().key + ": " + faults.front().reason);
  return camera;
}

/// Where a camera stands in its device.
std::optional<SE3> placement_of(const Values& values, const std::string& kind) {
  const auto T = matrix_of(values, "m_calibration" + kind + "Extrinsic");
  if (!T) return SE3();
  const Mat3 R = T->topLeftCorner<3, 3>();
  if (!((R * R.transpose()).isIdentity(1e-3) && R.determinant() > 0)) return std::nullopt;
  return SE3(Eigen::Quaterniond(R), T->topRightCorner<3, 1>());
}

}  // namespace

std::optional<Result<FusionInfo>> parse_fusion_info(std::string_view text,
                                                    const std::string& name) {
  if (text.find("m_calibrationColorIntrinsic") == std::string_view::npos) return std::nullopt;
  const Values values = values_of(text);
  const auto refuse = [&](const std::string& what) {
    return Result<FusionInfo>(Error{ErrorKind::kConfig, name + ": " + what});
  };
  const auto colour = lens_of(values, "Color");
  if (!colour.ok()) return refuse(colour.error().message);
  FusionInfo info{name, *colour, std::nullopt};
  if (!values.contains("m_calibrationDepthIntrinsic")) return Result<FusionInfo>(info);
  const auto lens = lens_of(values, "Depth");
  if (!lens.ok()) return refuse(lens.error().message);
  const auto T_device_colour = placement_of(values, "Color");
  const auto T_device_depth = placement_of(values, "Depth");
  if (!T_device_colour || !T_device_depth)
    return refuse("m_calibration...Extrinsic: is no rigid motion");
  const SE3 T_colour_depth = T_device_colour->inverse() * *T_device_depth;
  if (const auto wrong = fault_of_placement(T_colour_depth.quaternion(), T_colour_depth.t());
      !wrong.empty())
    return refuse("m_calibrationDepthExtrinsic: " + wrong);
  info.depth = DepthCamera{*lens, T_colour_depth};
  return Result<FusionInfo>(info);
}

Result<std::optional<FusionInfo>> read_fusion_info(const std::filesystem::path& folder) {
  for (const char* name : {"info.txt", "_info.txt"}) {
    const auto path = folder / name;
    std::error_code code;
    if (!std::filesystem::is_regular_file(path, code)) continue;
    const auto text = read_file(path, std::size_t{1} << 20);
    if (!text.ok()) return Error{ErrorKind::kConfig, text.error().message};
    const auto info = parse_fusion_info(*text, path.string());
    if (!info) continue;
    if (!info->ok()) return info->error();
    return std::optional(info->value());
  }
  return std::optional<FusionInfo>();
}

}  // namespace ygslam
