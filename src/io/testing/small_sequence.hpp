// For tests: a tiny sequence in TUM layout on disk.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>

#include "core/rng.hpp"
#include "io/image_file.hpp"
#include "io/sequence.hpp"
#include "io/testing/temp_folder.hpp"
#include "io/text.hpp"

namespace ygslam::testing {

inline ColourImage random_colour(int width, int height, Rng& rng) {
  ColourImage image(width, height);
  for (Rgb8& pixel : image) {
    pixel = {static_cast<std::uint8_t>(rng.below(256)), static_cast<std::uint8_t>(rng.below(256)),
             static_cast<std::uint8_t>(rng.below(256))};
  }
  return image;
}

template <typename T>
Image<T> random_grey(int width, int height, Rng& rng) {
  Image<T> image(width, height);
  for (T& pixel : image) pixel = static_cast<T>(rng.next());
  return image;
}

struct SmallSequence {
  int count = 10;
  int width = 32, height = 24;
  std::int64_t first_ns = 1'000'000'000'000;
  std::int64_t interval_ns = 33'333'000;
  std::int64_t depth_offset_ns = 0;
  double depth_rate = 1;  ///< of its clock against the colour camera's
  bool jpeg = false;
  bool associations = false;  ///< else rgb.txt and depth.txt
  std::string calibration = "fx 30\nfy 30\ncx 15.5\ncy 11.5\ndepth_scale 5000\n";

  [[nodiscard]] std::string colour_file(int i) const {
    return "rgb/" + format_stamp({first_ns + i * interval_ns}, 6) + (jpeg ? ".jpg" : ".png");
  }
  [[nodiscard]] std::string depth_file(int i) const {
    return "depth/" + format_stamp(depth_stamp(i), 6) + ".png";
  }

  [[nodiscard]] Timestamp depth_stamp(int i) const {
    const double step_ns = static_cast<double>(interval_ns) / depth_rate;
    return {first_ns + depth_offset_ns + static_cast<std::int64_t>(i * step_ns)};
  }

  void write_to(const std::filesystem::path& root) const {
    Rng rng(7);
    std::string colours = "# colour images\r\n";
    std::string depths = "# depth maps\n";
    std::string pairs;
    for (int i = 0; i < count; ++i) {
      const ColourImage colour = random_colour(width, height, rng);
      write(root / colour_file(i), jpeg ? encode_jpeg(colour) : encode_png(colour));
      write(root / depth_file(i), encode_png(random_grey<std::uint16_t>(width, height, rng)));
      const std::string a = format_stamp({first_ns + i * interval_ns}, 6) + " " + colour_file(i);
      const std::string b = format_stamp(depth_stamp(i), 6) + " " + depth_file(i);
      colours += a + "\r\n";
      depths += b + "\n";
      pairs += a + " " + b + "\n";
    }
    write(root / "rgb.txt", colours);
    write(root / "depth.txt", depths);
    if (associations) write(root / "associations.txt", pairs);
    if (!calibration.empty()) write(root / "calibration.txt", calibration);
  }
};

/// Whether a warning holds these words.
inline bool warns_of(const Sequence& sequence, const std::string& what) {
  return std::any_of(sequence.warnings.begin(), sequence.warnings.end(),
                     [&](const std::string& w) { return w.find(what) != std::string::npos; });
}

}  // namespace ygslam::testing
