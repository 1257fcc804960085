// Learns the 256 binary tests of src/features/brief_pattern.cpp and prints that file.
//   learn_brief_pattern [IMAGE...]
// Trains on corners of rendered pictures (and of the images named) seen again under warps, light
// and noise. Rublee et al. 2011 choose tests of high variance and low correlation; this looks at
// what they are for: it adds, one by one, the test that best separates the distances of true
// matches from those of false ones (Fisher's criterion), so that unstable tests and repetitions
// of earlier ones gain nothing. A second round takes the false matches nearest to the true ones
// under the first round's tests.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "core/rng.hpp"
#include "features/brief.hpp"
#include "features/orb.hpp"
#include "image/cv_view.hpp"
#include "texture.hpp"

namespace ygslam::bench {
namespace {

constexpr int kRenderedPictures = 40;
constexpr int kWarpsPerPicture = 3;
constexpr int kMaxPairs = 8000;
constexpr int kCandidates = 12000;
constexpr double kSameCorner_px = 1.5;  // of the level

struct Point {
  int u, v;
};

// All offsets a test may look at.
std::vector<Point> disc(int radius) {
  std::vector<Point> points;
  for (int v = -radius; v <= radius; ++v) {
    for (int u = -radius; u <= radius; ++u) {
      if (u * u + v * v <= radius * radius) points.push_back({u, v});
    }
  }
  return points;
}

// Smoothed intensities at the points of the disc, turned to the corner's orientation.
using Patch = std::vector<std::uint8_t>;

struct Pair {
  Patch first, second;    // the same corner in two views
  std::size_t view = 0;   // which warp they come from
  Eigen::Vector2f uv_px;  // in the second view
};

std::vector<Patch> cut_patches(const GreyImage& image, const PyramidScales& scales,
                               const Features& features, const std::vector<Point>& points) {
  std::vector<Patch> patches(features.size());
  PaddedImage level, next, smooth;
  level.assign(image, kLevelBorder_px);
  for (int octave = 0; octave < scales.levels(); ++octave) {
    const double scale = scales.of(octave);
    if (octave > 0) {
      const int width = static_cast<int>((image.width() - 1) / scale) + 1;
      const int height = static_cast<int>((image.height() - 1) / scale) + 1;
      reduce(level, scales.of(1), width, height, next);
      std::swap(level, next);
    }
    blur_7x7(level, smooth);
    for (std::size_t i = 0; i < features.size(); ++i) {
      const Feature& f = features.points[i];
      if (f.octave != octave) continue;
      const int u0 = static_cast<int>(std::lround(f.uv_px.x() / scale));
      const int v0 = static_cast<int>(std::lround(f.uv_px.y() / scale));
      const float c = std::cos(f.angle_rad);
      const float s = std::sin(f.angle_rad);
      for (const Point& p : points) {
        const auto du = static_cast<int>(std::lround(c * p.u - s * p.v));
        const auto dv = static_cast<int>(std::lround(s * p.u + c * p.v));
        patches[i].push_back(smooth.row(v0 + dv)[u0 + du]);
      }
    }
  }
  return patches;
}

void add_pairs(const GreyImage& image, const std::string& kind, std::size_t view,
               const std::vector<Point>& points, Rng& rng, std::vector<Pair>& pairs) {
  OrbExtractor extractor{OrbConfig{}};
  const Warp warp = make_warp(kind, image.width(), image.height(), rng);
  const GreyImage warped = apply_warp(image, warp, rng);
  const Features a = extractor.extract(image);
  const Features b = extractor.extract(warped);
  const std::vector<Patch> patches_a = cut_patches(image, extractor.scales(), a, points);
  const std::vector<Patch> patches_b = cut_patches(warped, extractor.scales(), b, points);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Eigen::Vector2f expected = warp(a.points[i].uv_px.cast<double>()).cast<float>();
    double nearest = kSameCorner_px * extractor.scales().of(a.points[i].octave);
    std::size_t partner = b.size();
    for (std::size_t j = 0; j < b.size(); ++j) {
      const double d = (b.points[j].uv_px - expected).norm();
      if (d < nearest && std::abs(a.points[i].octave - b.points[j].octave) <= 1) {
        nearest = d;
        partner = j;
      }
    }
    if (partner == b.size()) continue;
    pairs.push_back({patches_a[i], patches_b[partner], view, b.points[partner].uv_px});
  }
}

struct Test {
  int first, second;  // points
};

// Which tests differ between two patches of each of the rows.
struct Table {
  std::size_t rows = 0;
  std::vector<std::vector<std::uint8_t>> differs;  // [test][row]
  Table(const std::vector<Test>& tests,
        const std::vector<std::pair<const Patch*, const Patch*>>& of)
      : rows(of.size()) {
    for (const Test& t : tests) {
      std::vector<std::uint8_t> column;
      column.reserve(rows);
      for (const auto& [a, b] : of) {
        const bool bit_a = (*a)[t.first] < (*a)[t.second];
        const bool bit_b = (*b)[t.first] < (*b)[t.second];
        column.push_back(bit_a != bit_b);
      }
      differs.push_back(std::move(column));
    }
  }
};

// Mean and variance of the distance, kept up while tests are added.
class Distances {
 public:
  explicit Distances(std::size_t rows) : sum_(rows, 0) {}
  void add(const std::vector<std::uint8_t>& column) {
    for (std::size_t i = 0; i < column.size(); ++i) sum_[i] += column[i];
    total_ = square_ = 0;
    for (const std::int16_t s : sum_) {
      total_ += s;
      square_ += static_cast<double>(s) * s;
    }
  }
  // After adding the column: {mean, variance}.
  [[nodiscard]] std::pair<double, double> with(const std::vector<std::uint8_t>& column) const {
    std::int32_t ones = 0;
    std::int32_t cross = 0;
    for (std::size_t i = 0; i < column.size(); ++i) {
      ones += column[i];
      cross += static_cast<std::int16_t>(column[i]) * sum_[i];
    }
    const auto n = static_cast<double>(sum_.size());
    const double mean = (total_ + ones) / n;
    return {mean, (square_ + 2.0 * cross + ones) / n - mean * mean};
  }

 private:
  std::vector<std::int16_t> sum_;
  double total_ = 0, square_ = 0;
};

std::vector<Test> choose(const std::vector<Test>& tests, const Table& same, const Table& other) {
  Distances d_same(same.rows);
  Distances d_other(other.rows);
  std::vector<char> used(tests.size());
  std::vector<Test> chosen;
  double separation = 0;
  while (chosen.size() < 256) {
    std::size_t best = 0;
    double best_separation = -1e9;
    for (std::size_t t = 0; t < tests.size(); ++t) {
      if (used[t]) continue;
      const auto [mean_s, var_s] = d_same.with(same.differs[t]);
      const auto [mean_o, var_o] = d_other.with(other.differs[t]);
      const double value = (mean_o - mean_s) / std::sqrt(var_s + var_o + 0.05);
      if (value > best_separation) {
        best_separation = value;
        best = t;
      }
    }
    used[best] = 1;
    d_same.add(same.differs[best]);
    d_other.add(other.differs[best]);
    chosen.push_back(tests[best]);
    separation = best_separation;
  }
  std::fprintf(stderr, "separation %.3f\n", separation);
  return chosen;
}

int patch_distance(const Patch& a, const Patch& b, const std::vector<Test>& tests) {
  int d = 0;
  for (const Test& t : tests) d += (a[t.first] < a[t.second]) != (b[t.first] < b[t.second]);
  return d;
}

using Rows = std::vector<std::pair<const Patch*, const Patch*>>;

Rows random_negatives(const std::vector<Pair>& pairs, Rng& rng) {
  Rows rows;
  for (const Pair& p : pairs) {
    const Pair& q = pairs[rng.below(static_cast<std::uint32_t>(pairs.size()))];
    if (&p != &q) rows.emplace_back(&p.first, &q.second);
  }
  return rows;
}

// The nearest false match of the same view.
Rows hard_negatives(const std::vector<Pair>& pairs, const std::vector<Test>& tests) {
  Rows rows;
  for (const Pair& p : pairs) {
    const Patch* nearest = nullptr;
    int least = 257;
    for (const Pair& q : pairs) {
      if (q.view != p.view || (q.uv_px - p.uv_px).norm() < 8) continue;
      const int d = patch_distance(p.first, q.second, tests);
      if (d < least) {
        least = d;
        nearest = &q.second;
      }
    }
    if (nearest != nullptr) rows.emplace_back(&p.first, nearest);
  }
  return rows;
}

void print_pattern(const std::vector<Test>& tests, const std::vector<Point>& points) {
  std::printf(
      "// Written by tools/learn_brief_pattern.cpp; do not edit.\n"
      "#include \"features/brief.hpp\"\n\nnamespace ygslam {\n\n// clang-format off\n"
      "const std::array<BriefTest, 256> kBriefPattern = {{\n");
  for (std::size_t i = 0; i < tests.size(); ++i) {
    const Point& a = points[tests[i].first];
    const Point& b = points[tests[i].second];
    std::printf("%s{%d, %d, %d, %d},%s", i % 4 == 0 ? "    " : " ", a.u, a.v, b.u, b.v,
                i % 4 == 3 ? "\n" : "");
  }
  std::printf("}};\n// clang-format on\n\n}  // namespace ygslam\n");
}

int learn(const std::vector<std::string>& files) {
  Rng rng(2011);
  const std::vector<Point> points = disc(kTestRadius);
  std::vector<GreyImage> images;
  for (int i = 0; i < kRenderedPictures; ++i) images.push_back(render_texture(640, 480, 1000 + i));
  for (const std::string& file : files) {
    const cv::Mat mat = cv::imread(file, cv::IMREAD_GRAYSCALE);
    if (mat.empty()) {
      std::fprintf(stderr, "%s: not an image\n", file.c_str());
      return 4;
    }
    GreyImage image(mat.cols, mat.rows);
    mat.copyTo(cv_view(image));
    images.push_back(image);
  }
  const std::array<std::string, 6> kinds = {"rotation", "scale", "perspective",
                                            "light",    "noise", "rotation"};
  std::vector<Pair> all;
  std::size_t view = 0;
  for (const GreyImage& image : images) {
    for (int w = 0; w < kWarpsPerPicture; ++w, ++view) {
      add_pairs(image, kinds[view % kinds.size()], view, points, rng, all);
    }
  }
  std::vector<Pair> pairs;
  const double keep =
      std::min(1.0, static_cast<double>(kMaxPairs) / static_cast<double>(all.size()));
  for (Pair& p : all) {
    if (rng.uniform() < keep) pairs.push_back(std::move(p));
  }
  std::fprintf(stderr, "%zu images, %zu of %zu pairs\n", images.size(), pairs.size(), all.size());

  std::vector<Test> tests;
  const auto n = static_cast<std::uint32_t>(points.size());
  while (tests.size() < kCandidates) {
    const Test t{static_cast<int>(rng.below(n)), static_cast<int>(rng.below(n))};
    const Point& a = points[t.first];
    const Point& b = points[t.second];
    if ((a.u - b.u) * (a.u - b.u) + (a.v - b.v) * (a.v - b.v) >= 9) tests.push_back(t);
  }
  Rows true_rows;
  for (const Pair& p : pairs) true_rows.emplace_back(&p.first, &p.second);
  const Table same(tests, true_rows);
  Rows negatives = random_negatives(pairs, rng);
  std::vector<Test> chosen = choose(tests, same, Table(tests, negatives));
  const Rows hard = hard_negatives(pairs, chosen);
  negatives.resize(negatives.size() / 2);
  negatives.insert(negatives.end(), hard.begin(), hard.end());
  chosen = choose(tests, same, Table(tests, negatives));
  print_pattern(chosen, points);
  return 0;
}

}  // namespace
}  // namespace ygslam::bench

int main(int argc, char** argv) {
  return ygslam::bench::learn(std::vector<std::string>(argv + 1, argv + argc));
}
