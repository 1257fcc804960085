#include "io/associated_poses.hpp"

#include <algorithm>
#include <cmath>

#include "io/image_file.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"

namespace ygslam {
namespace {

using Words = std::vector<std::string_view>;
constexpr std::ptrdiff_t kPoseWords = 7;

/// Whether the seven words from `first` on are a position and a unit quaternion.
bool is_pose(Words::const_iterator first) {
  double length = 0;
  for (std::ptrdiff_t i = 0; i < kPoseWords; ++i) {
    const auto number = parse_number(first[i]);
    if (!number) return false;
    if (i >= 3) length += *number * *number;
  }
  return std::abs(std::sqrt(length) - 1) <= kQuaternionTolerance;
}

std::string_view between(std::string_view line, std::string_view from, std::string_view to) {
  const auto at = static_cast<std::size_t>(from.data() - line.data());
  return line.substr(at, static_cast<std::size_t>(to.data() + to.size() - from.data()));
}

/// Whether the words are `[stamp] FILE [stamp] FILE ...`, without other numbers.
bool are_images(const Words& words) {
  for (std::size_t i = 1; i < words.size(); ++i)
    if (parse_number(words[i - 1]) && parse_number(words[i])) return false;
  return !words.empty() && !parse_number(words.back());
}

bool is_image(std::string_view word) { return has_image_ending(std::filesystem::path(word)); }

}  // namespace

AssociationLine split_association(std::string_view line) {
  const Words words = words_of(line);
  constexpr std::ptrdiff_t kFewest = 2 + kPoseWords;
  if (std::ssize(words) < kFewest) return {line, {}};
  if (is_pose(words.end() - kPoseWords)) {
    auto first = words.end() - kPoseWords;
    if (parse_stamp(*(first - 1))) --first;
    return {between(line, words.front(), *(first - 1)), {first, words.end()}};
  }
  const bool is_before = std::ssize(words) > kFewest && parse_stamp(words[0]) &&
                         is_pose(words.begin() + 1) && parse_stamp(words[1 + kPoseWords]);
  if (!is_before) return {line, {}};
  return {between(line, words[1 + kPoseWords], words.back()),
          {words.begin(), words.begin() + 1 + kPoseWords}};
}

std::optional<std::string> poses_of_associations(std::string_view text) {
  std::string poses;
  int line_number = 1;
  for (const TextLine& line : data_lines(text)) {
    const AssociationLine split = split_association(line.text);
    const Words images = words_of(split.images);
    if (split.pose.empty() || !are_images(images) ||
        std::none_of(images.begin(), images.end(), is_image))
      return std::nullopt;
    for (; line_number < line.number; ++line_number) poses += '\n';
    if (std::ssize(split.pose) == kPoseWords) poses.append(images.front()) += ' ';
    for (const std::string_view word : split.pose) poses.append(word) += ' ';
  }
  if (poses.empty()) return std::nullopt;
  return poses;
}

}  // namespace ygslam
