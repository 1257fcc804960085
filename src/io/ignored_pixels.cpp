#include "io/ignored_pixels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "io/image_file.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMostBytes = std::size_t{64} << 20;

std::string shown(const PixelRectangle& r) {
  return std::to_string(r.u) + " " + std::to_string(r.v) + " " + std::to_string(r.width) + " " +
         std::to_string(r.height);
}

std::string read_image(const std::string& name, const std::filesystem::path& folder,
                       CameraConfig& camera) {
  if (folder.empty()) return "needs rectangles, x y width height, not the name of a file";
  const auto path = folder / name;
  const auto bytes = read_file(path, kMostBytes);
  if (!bytes.ok()) return bytes.error().message;
  const bool says_size = camera.width > 0 && camera.height > 0;
  const auto size =
      says_size ? std::optional(ImageSize{camera.width, camera.height}) : std::nullopt;
  const auto mask = decode_grey(*bytes, size);
  if (!mask.ok()) return path.string() + ": " + mask.error().message;
  camera.width = mask->width();
  camera.height = mask->height();
  camera.ignored = rectangles_of(*mask);
  return {};
}

std::string read_rectangles(std::span<const std::string_view> words, CameraConfig& camera) {
  if (words.size() % 4 != 0) return "needs four numbers for each rectangle: x y width height";
  std::array<int, 4> numbers{};
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto value = parse_number(words[i]);
    if (!value || *value != std::floor(*value) || std::abs(*value) > kMaxImageSide_px)
      return "'" + printable(words[i]) + "' is not a whole number of pixels";
    numbers[i % 4] = static_cast<int>(*value);
    if (i % 4 == 3) camera.ignored.push_back({numbers[0], numbers[1], numbers[2], numbers[3]});
  }
  return {};
}

}  // namespace

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

std::vector<PixelRectangle> rectangles_of(const GreyImage& mask) {
  std::vector<PixelRectangle> done;
  std::map<std::pair<int, int>, PixelRectangle> open;  // by first column and width: reach this row
  for (int v = 0; v < mask.height(); ++v) {
    std::map<std::pair<int, int>, PixelRectangle> here;
    for (int u = 0; u < mask.width(); ++u) {
      if (mask.at(u, v) == 0) continue;
      const int first = u;
      while (u < mask.width() && mask.at(u, v) != 0) ++u;
      const std::pair run{first, u - first};
      const auto above = open.find(run);
      PixelRectangle rectangle{first, v, run.second, 1};
      if (above != open.end()) {
        rectangle = above->second;
        ++rectangle.height;
        open.erase(above);
      }
      here.emplace(run, rectangle);
    }
    for (const auto& [run, rectangle] : open) done.push_back(rectangle);
    open = std::move(here);
  }
  for (const auto& [run, rectangle] : open) done.push_back(rectangle);
  return done;
}

std::string read_ignored(std::span<const std::string_view> words,
                         const std::filesystem::path& folder, CameraConfig& camera) {
  if (words.empty()) return {};
  if (words.size() == 1 && !parse_number(words.front()))
    return read_image(std::string(words.front()), folder, camera);
  return read_rectangles(words, camera);
}

std::string ignored_text(const CameraConfig& camera) {
  std::string text;
  for (const PixelRectangle& r : camera.ignored) text += (text.empty() ? "" : " ") + shown(r);
  return text;
}

std::optional<std::string> ignored_fault(const CameraConfig& camera) {
  for (const PixelRectangle& r : camera.ignored) {
    const bool is_in = r.u >= 0 && r.v >= 0 && r.width > 0 && r.height > 0 &&
                       r.u <= camera.width - r.width && r.v <= camera.height - r.height;
    if (!is_in)
      return "must lie in the image of " + shown_size({camera.width, camera.height}) + ", is " +
             shown(r) + " (x y width height)";
  }
  return std::nullopt;
}

}  // namespace ygslam
