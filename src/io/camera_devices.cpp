#include "io/camera_devices.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "io/calibration.hpp"

namespace ygslam {
namespace {

using Kind = ImageShutter::Kind;

// Kinect: 480 rows at 54.21 us (libfreenect, pull request 670). Its infrared image is read in 30.5
// ms; registered to colour a row of it takes 585 / 525 of that. Xtion and Carmine are of the same
// design; nobody published a figure of their own.
constexpr ImageShutter kKinectColour{Kind::kRolling, 26.0};
constexpr ImageShutter kKinectDepth{Kind::kRolling, 34.0};

constexpr std::array<CameraDevice, 9> kDevices = {{
    {"kinect_v1", "Microsoft Kinect (Xbox 360)", kKinectColour, kKinectDepth},
    {"xtion", "Asus Xtion Pro Live", kKinectColour, kKinectDepth, false},
    {"carmine", "PrimeSense Carmine", kKinectColour, kKinectDepth, false},
    {"azure_kinect", "Azure Kinect", {Kind::kRollingUnknown}, {Kind::kGlobal}},
    {"realsense_d415", "RealSense D415", {Kind::kRollingUnknown}, {Kind::kRollingUnknown}},
    {"realsense_d435", "RealSense D435", {Kind::kRollingUnknown}, {Kind::kGlobal}},
    {"realsense_d455", "RealSense D455", {Kind::kGlobal}, {Kind::kGlobal}},
    {"oak_d", "Luxonis OAK-D", {Kind::kRollingUnknown}, {Kind::kGlobal}},
    {"global_shutter", "any camera that takes an image at once", {Kind::kGlobal}, {Kind::kGlobal}},
}};

constexpr double kSameIntrinsics_px = 0.05;
constexpr double kDelivered_px = 525;  // focal length in PrimeSense's driver
constexpr double kDeliveredCentre_px = 1.5;
constexpr double kSimilarFocal = 0.05;  // 525 of the default, 517 and 535 as calibrated

bool same_intrinsics(const CameraConfig& a, const CameraConfig& b) {
  return std::abs(a.fx - b.fx) < kSameIntrinsics_px && std::abs(a.fy - b.fy) < kSameIntrinsics_px &&
         std::abs(a.cx - b.cx) < kSameIntrinsics_px && std::abs(a.cy - b.cy) < kSameIntrinsics_px;
}

/// Whether a word stands in a name, set off by what is no letter and no digit.
bool names(std::string_view folder_name, std::string_view word) {
  const auto outside = [&](std::size_t at) {
    return at >= folder_name.size() ||
           std::isalnum(static_cast<unsigned char>(folder_name[at])) == 0;
  };
  for (std::size_t at = folder_name.find(word); at != std::string_view::npos;
       at = folder_name.find(word, at + 1)) {
    if ((at == 0 || outside(at - 1)) && outside(at + word.size())) return true;
  }
  return false;
}

struct KnownRecordings {
  std::string_view preset;  // a folder name of camera_preset()
  std::string_view short_name;
  std::string_view device;
  double depth_delay_ms = 0;
};
// freiburg1's depth images were stamped late: `ygslam calibrate` finds 15.7 +- 0.3 ms on rpy.
constexpr std::array<KnownRecordings, 4> kRecordings = {{{"freiburg1", "fr1", "kinect_v1", -16},
                                                         {"freiburg2", "fr2", "kinect_v1"},
                                                         {"freiburg3", "fr3", "xtion"},
                                                         {"rgbd_bonn", "bonn", "xtion"}}};

}  // namespace

std::span<const CameraDevice> camera_devices() { return kDevices; }

const CameraDevice* find_camera_device(std::string_view name) {
  const auto device = std::find_if(kDevices.begin(), kDevices.end(),
                                   [&](const CameraDevice& d) { return d.name == name; });
  return device == kDevices.end() ? nullptr : &*device;
}

void set_shutter(const CameraDevice& device, CameraConfig& camera) {
  camera.colour_readout_ms = device.colour.readout_ms;
  camera.depth_readout_ms = device.depth.readout_ms;
  camera.depth_delay_ms = 0;
  camera.shutter_known = device.is_known() && device.is_measured;
}

void suspect(const CameraDevice& device, CameraConfig& camera) {
  camera.suspected_colour_readout_ms = device.colour.readout_ms;
  camera.suspected_depth_readout_ms = device.depth.readout_ms;
}

RecognisedDevice recognised_device(std::string_view folder_name, const CameraConfig& camera) {
  for (const KnownRecordings& known : kRecordings) {
    const CameraConfig preset = camera_preset(known.preset)->camera;
    const bool named = folder_name.find(known.preset) != std::string_view::npos ||
                       names(folder_name, known.short_name);
    const bool similar = std::abs(camera.fx / preset.fx - 1) < kSimilarFocal;
    const bool same = preset.is_distorted() && same_intrinsics(camera, preset);
    if ((named && similar) || same)
      return {find_camera_device(known.device), true,
              named && similar ? "taken from the name of the folder" : "recognised by its lens",
              known.depth_delay_ms};
  }
  const bool as_delivered = camera.fx == kDelivered_px && camera.fy == kDelivered_px &&
                            std::abs(camera.cx - 320) < kDeliveredCentre_px &&
                            std::abs(camera.cy - 240) < kDeliveredCentre_px;
  if (!as_delivered) return {};
  return {find_camera_device("kinect_v1"), false, "by the 525 px"};
}

}  // namespace ygslam
