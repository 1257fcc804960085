#include "eval/mot_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr double kMaxFrames = 1e6;

bool is_whole(double value, double least, double most) {
  return value == std::floor(value) && value >= least && value <= most;
}

Status read_into(const std::filesystem::path& file, std::vector<IdBox> BoxFrame::*boxes,
                 std::vector<BoxFrame>& frames) {
  const auto text = read_file(file);
  if (!text.ok()) return text.error();
  for (const TextLine& line : data_lines(*text)) {
    const auto fault = [&](const char* what) {
      return Error{ErrorKind::kInput,
                   file.string() + ":" + std::to_string(line.number) + ": " + what};
    };
    std::array<double, 7> v{0, 0, 0, 0, 0, 0, 1};
    const auto words = words_of(line.text, ",");
    for (std::size_t i = 0; i < v.size() && (i < 6 || i < words.size()); ++i) {
      const auto number = i < words.size() ? parse_number(words[i]) : std::nullopt;
      if (!number) return fault("is not frame,id,left,top,width,height[,counts]");
      v[i] = *number;
    }
    if (!is_whole(v[0], 1, kMaxFrames) || !is_whole(v[1], -1e9, 1e9))
      return fault("frame (from 1) and id must be whole numbers");
    const auto frame = static_cast<std::size_t>(v[0]) - 1;
    if (frame >= frames.size()) frames.resize(frame + 1);
    std::vector<IdBox>& list = frames[frame].*boxes;
    const int id = static_cast<int>(v[1]);
    if (std::any_of(list.begin(), list.end(), [&](const IdBox& box) { return box.id == id; }))
      return fault("this id is in this frame already");
    const PixelBox box{static_cast<float>(v[2]), static_cast<float>(v[3]),
                       static_cast<float>(v[2] + v[4]), static_cast<float>(v[3] + v[5])};
    list.push_back({id, box, v[6] != 0});
  }
  return Ok{};
}

}  // namespace

std::string mot_text(std::span<const BoxFrame> frames, std::vector<IdBox> BoxFrame::*boxes) {
  std::string text;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    for (const IdBox& b : frames[k].*boxes) {
      char line[160];
      std::snprintf(line, sizeof line, "%zu,%d,%.2f,%.2f,%.2f,%.2f,%d,-1,-1,-1\n", k + 1, b.id,
                    b.box.x0, b.box.y0, b.box.width(), b.box.height(), b.counts ? 1 : 0);
      text += line;
    }
  }
  return text;
}

Result<std::vector<BoxFrame>> read_mot(const std::filesystem::path& truth,
                                       const std::filesystem::path& tracked) {
  std::vector<BoxFrame> frames;
  Status read = read_into(truth, &BoxFrame::truth, frames);
  if (read.ok()) read = read_into(tracked, &BoxFrame::tracked, frames);
  if (!read.ok()) return read.error();
  return frames;
}

}  // namespace ygslam
