#include "inertial/imu_fault.hpp"

namespace ygslam {

const char* to_string(ImuFault fault) {
  switch (fault) {
    case ImuFault::kNone:
      return "none";
    case ImuFault::kSilent:
      return "its samples stopped or left a gap";
    case ImuFault::kStands:
      return "its readings stay the same or are zero, as of a driver that hangs";
    case ImuFault::kRange:
      return "its readings are beyond its range (other units?)";
    case ImuFault::kClock:
      return "its clock went back or jumped";
    case ImuFault::kOffset:
      return "whatever the offset of its clock (0.5 s at most), it does not turn as the camera "
             "does (are its axes and T_camera_imu right?)";
    case ImuFault::kToldOffset:
      return "the offset of its clock is another than time_offset_s says";
    case ImuFault::kUnits:
      return "it does not measure in m/s2 and rad/s";
    case ImuFault::kGravity:
      return "what it measures is not gravity's size";
    case ImuFault::kDisagrees:
      return "it disagrees with what the camera sees (are its axes, T_camera_imu and its clock "
             "right?)";
    case ImuFault::kBias:
      return "its bias is larger than any sensor's (are its axes and T_camera_imu right?)";
    case ImuFault::kNoReadings:
      return "no valid reading came in the first 2 s";
    case ImuFault::kNoNumbers:
      return "its readings are no numbers, or of no motion";
    case ImuFault::kOtherTime:
      return "none of its readings is of the images' time";
  }
  return "?";
}

bool is_wrong(ImuFault fault) {
  switch (fault) {
    case ImuFault::kOffset:
    case ImuFault::kToldOffset:
    case ImuFault::kUnits:
    case ImuFault::kGravity:
    case ImuFault::kDisagrees:
    case ImuFault::kBias:
      return true;
    default:
      return false;
  }
}

}  // namespace ygslam
