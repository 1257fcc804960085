// Text that could be read as a trajectory although it is something else: better refused than read.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

inline constexpr std::size_t kKittiColumns = 12;
// Printed with few decimals a rotation matrix is only nearly orthonormal.
inline constexpr double kRotationTolerance = 1e-2;
// Printed with two decimals a unit quaternion is so much longer or shorter.
inline constexpr double kQuaternionTolerance = 0.02;

/// Lines that end in a carriage return alone (as on the first Macintosh) would all be one line.
/// @param name for the message. @return kInput naming file and line.
[[nodiscard]] Status check_line_ends(std::string_view text, const std::string& name);

/// Text of another encoding, or no text at all. @param name for the message. @return kInput.
[[nodiscard]] Status check_is_text(std::string_view text, const std::string& name);

/// Digits, a comma, digits: "0,5"; a sign and an exponent may be there.
[[nodiscard]] bool is_decimal_comma(std::string_view word);
/// Whether a line of numbers has commas for decimal points: "1,5 2,0 0,25" (blanks or semicolons
/// between numbers), or whole numbers between commas, too many for any format.
[[nodiscard]] bool has_decimal_commas(std::string_view line);

/// Whether the data begin as JSON does, or a line has numbers in brackets, as Python prints lists
/// and arrays. @return the line's number, 0 if not.
[[nodiscard]] int line_with_brackets(std::string_view text);

/// @param numbers of a pose's matrix row by row, of three or four rows. @return nullopt where they
/// are no rotation, or the last row is not 0 0 0 1.
[[nodiscard]] std::optional<SE3> rigid_motion(std::span<const double> numbers);

/// Whether a line of 12 numbers has the rotation of a KITTI pose, or one of 11 numbers does where
/// one is missing.
[[nodiscard]] bool looks_like_kitti(std::string_view line);

}  // namespace ygslam
