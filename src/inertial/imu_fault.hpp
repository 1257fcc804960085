#pragma once

#include <cstdint>

namespace ygslam {

/// Why an IMU is not believed.
enum class ImuFault : std::uint8_t {
  kNone,
  kSilent,      ///< its samples stopped, or left a gap
  kStands,      ///< its readings stay the same to the last bit, or are zero: a driver that hangs
  kRange,       ///< its readings are beyond its range, or beyond that of any sensor
  kClock,       ///< its clock went back or jumped
  kOffset,      ///< whatever the offset of its clock, it does not turn as the camera does
  kToldOffset,  ///< the offset of its clock is another than the told one
  kUnits,       ///< it measures in g, or degrees
  kGravity,     ///< its acceleration at rest is not gravity's
  kDisagrees,   ///< with vision: axes swapped, wrong place, wrong clock, broken
  kBias,        ///< larger than any sensor's
  // Nothing of it could be used since the first frame:
  kNoReadings,  ///< none came
  kNoNumbers,   ///< ... that is one
  kOtherTime,   ///< none is of a frame's time
};
[[nodiscard]] const char* to_string(ImuFault fault);
/// What it told before was wrong, too; one that merely stopped was right until then.
[[nodiscard]] bool is_wrong(ImuFault fault);

}  // namespace ygslam
