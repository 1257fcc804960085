#include "eval/surface_score.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>
#include <unsupported/Eigen/BVH>

#include "core/check.hpp"
#include "core/statistics.hpp"
#include "eval/change_score.hpp"

namespace ygslam {
namespace {

using Eigen::Vector3d;
using Box = Eigen::AlignedBox3d;

// After Ericson, Real-Time Collision Detection, 5.1.5: by the region that the point lies before.
double squared_distance(const Vector3d& p, const std::array<Vector3d, 3>& t) {
  const Vector3d ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return ap.squaredNorm();
  const Vector3d bp = p - t[1];
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return bp.squaredNorm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - d1 / (d1 - d3) * ab).squaredNorm();
  const Vector3d cp = p - t[2];
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return cp.squaredNorm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - d2 / (d2 - d6) * ac).squaredNorm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6)
    return (bp - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t[2] - t[1])).squaredNorm();
  const double sum = va + vb + vc;
  return (ap - vb / sum * ab - vc / sum * ac).squaredNorm();
}

class DistanceTree {
 public:
  explicit DistanceTree(const Surface& surface) : surface_(surface) {
    const bool has_triangles = !surface.triangles.empty();
    std::vector<int> objects(has_triangles ? surface.triangles.size() : surface.points.size());
    std::iota(objects.begin(), objects.end(), 0);
    std::vector<Box> boxes;
    boxes.reserve(objects.size());
    for (std::size_t i = 0; i < objects.size(); ++i) {
      Box box;
      if (has_triangles) {
        for (const Vector3d& corner : triangle(i)) box.extend(corner);
      } else {
        box.extend(surface.points[i].cast<double>());
      }
      boxes.push_back(box);
    }
    tree_.init(objects.begin(), objects.end(), boxes.begin(), boxes.end());
  }

  [[nodiscard]] double distance(const Vector3d& p) const {
    Nearest nearest{this, p};
    return std::sqrt(Eigen::BVMinimize(tree_, nearest));
  }

 private:
  using Tree = Eigen::KdBVH<double, 3, int>;
  struct Nearest {
    using Scalar = double;
    const DistanceTree* of;
    Vector3d p;
    [[nodiscard]] double minimumOnVolume(const Box& box) const {  // NOLINT: Eigen's names
      return box.squaredExteriorDistance(p);
    }
    [[nodiscard]] double minimumOnObject(int object) const {  // NOLINT
      const auto i = static_cast<std::size_t>(object);
      if (!of->surface_.triangles.empty()) return squared_distance(p, of->triangle(i));
      return (p - of->surface_.points[i].cast<double>()).squaredNorm();
    }
  };

  [[nodiscard]] std::array<Vector3d, 3> triangle(std::size_t i) const {
    std::array<Vector3d, 3> corners;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = surface_.points[surface_.triangles[i][k]].cast<double>();
    return corners;
  }

  const Surface& surface_;
  Tree tree_;
};

double area(const Eigen::Vector3f& ab, const Eigen::Vector3f& ac) {
  return static_cast<double>(ab.cross(ac).norm()) / 2;
}

double share_within(std::span<const float> distances_m, double within_m) {
  if (distances_m.empty()) return 0;
  const auto count = std::count_if(distances_m.begin(), distances_m.end(),
                                   [&](float d) { return static_cast<double>(d) <= within_m; });
  return static_cast<double>(count) / static_cast<double>(distances_m.size());
}

std::vector<Eigen::Vector3f> ghosts_of(std::span<const Eigen::Vector3f> samples,
                                       std::span<const float> distances_m,
                                       const std::vector<Eigen::Vector3f>& movers,
                                       double within_m) {
  if (movers.empty()) return {};
  std::vector<Eigen::Vector3f> off;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (static_cast<double>(distances_m[i]) > within_m) off.push_back(samples[i]);
  const auto near_m = distances_to({movers, {}}, off);
  std::vector<Eigen::Vector3f> ghosts;
  for (std::size_t i = 0; i < off.size(); ++i)
    if (static_cast<double>(near_m[i]) <= within_m) ghosts.push_back(off[i]);
  return ghosts;
}

}  // namespace

std::vector<float> distances_to(const Surface& surface, std::span<const Eigen::Vector3f> queries) {
  CHECK(!surface.points.empty(), "a distance to nothing");
  const DistanceTree tree(surface);
  std::vector<float> distances_m;
  distances_m.reserve(queries.size());
  for (const Eigen::Vector3f& query : queries)
    distances_m.push_back(static_cast<float>(tree.distance(query.cast<double>())));
  return distances_m;
}

double sample_count(const Surface& surface, double spacing_m) {
  if (surface.triangles.empty()) return static_cast<double>(surface.points.size());
  double area_m2 = 0;
  for (const auto& corners : surface.triangles) {
    const Eigen::Vector3f& a = surface.points[corners[0]];
    area_m2 += area(surface.points[corners[1]] - a, surface.points[corners[2]] - a);
  }
  return area_m2 / (spacing_m * spacing_m);
}

std::vector<Eigen::Vector3f> sample_surface(const Surface& surface, double spacing_m) {
  if (surface.triangles.empty()) return surface.points;
  std::vector<Eigen::Vector3f> samples;
  double due = 0.5;  // samples that the area so far is worth, less those taken
  double u = 0.5, v = 0.5;
  for (const auto& corners : surface.triangles) {
    const Eigen::Vector3f& a = surface.points[corners[0]];
    const Eigen::Vector3f ab = surface.points[corners[1]] - a, ac = surface.points[corners[2]] - a;
    due += area(ab, ac) / (spacing_m * spacing_m);
    for (; due >= 1; --due) {
      // The R2 sequence (Roberts 2018), folded into the triangle.
      u = std::fmod(u + 0.7548776662466927, 1.0);
      v = std::fmod(v + 0.5698402909980532, 1.0);
      const bool beyond = u + v > 1;
      samples.emplace_back(a + static_cast<float>(beyond ? 1 - u : u) * ab +
                           static_cast<float>(beyond ? 1 - v : v) * ac);
    }
  }
  return samples;
}

SurfaceScore score_surface(const Surface& map, const SurfaceTruth& truth,
                           const SurfaceScoreOptions& options) {
  SurfaceScore score;
  score.options = options;
  score.truth_samples = truth.seen.size();
  const auto samples =
      apart_from(sample_surface(map, options.spacing_m), truth.moved, options.margin_m);
  score.samples = samples.size();
  if (truth.movers) score.ghosts = 0;
  if (samples.empty()) return score;
  auto distances_m = distances_to(truth.surface, samples);
  score.mean_m = std::accumulate(distances_m.begin(), distances_m.end(), 0.0) /
                 static_cast<double>(samples.size());
  score.precision = share_within(distances_m, options.within_m);
  score.completeness = share_within(distances_to(map, truth.seen), options.within_m);
  const double sum = score.precision + score.completeness;
  score.f1 = sum > 0 ? 2 * score.precision * score.completeness / sum : 0;
  if (truth.movers) {
    const auto ghosts = ghosts_of(samples, distances_m, *truth.movers, options.within_m);
    const auto count = static_cast<double>(samples.size());
    score.ghosts = static_cast<double>(ghosts.size()) / count;
    const auto seen = apart_from(ghosts, truth.left_unseen, options.margin_m);
    score.ghosts_unseen = static_cast<double>(ghosts.size() - seen.size()) / count;
  }
  score.median_m = static_cast<double>(median(distances_m));  // reorders them
  return score;
}

nlohmann::json to_json(const SurfaceScore& score) {
  nlohmann::json json = {{"samples", score.samples},
                         {"truth_samples", score.truth_samples},
                         {"within_m", score.options.within_m},
                         {"accuracy_m", {{"mean", score.mean_m}, {"median", score.median_m}}},
                         {"precision", score.precision},
                         {"completeness", score.completeness},
                         {"f1", score.f1},
                         {"ghosts", nullptr},
                         {"ghosts_unseen", nullptr}};
  if (score.samples == 0) json["accuracy_m"] = json["precision"] = nullptr;
  if (score.ghosts) {
    json["ghosts"] = *score.ghosts;
    json["ghosts_unseen"] = score.ghosts_unseen;
  }
  return json;
}

std::string format_surface(const SurfaceScore& score, const std::string& name) {
  if (score.samples == 0)
    return name + ": empty, 0 % of " + std::to_string(score.truth_samples) +
           " samples of the truth\n";
  std::array<char, 512> text{};
  const double cm = 100 * score.options.within_m;
  std::snprintf(text.data(), text.size(),
                "accuracy      mean %.2f cm, median %.2f cm\n"
                "precision     %.2f %% of the map within %.0f cm of the true surface\n"
                "completeness  %.2f %% of what was seen within %.0f cm of the map\n"
                "F1            %.2f %%\n",
                100 * score.mean_m, 100 * score.median_m, 100 * score.precision, cm,
                100 * score.completeness, cm, 100 * score.f1);
  std::string table = name + ": " + std::to_string(score.samples) + " samples of the map, " +
                      std::to_string(score.truth_samples) + " of the truth\n" + text.data();
  if (!score.ghosts) return table;
  std::snprintf(text.data(), text.size(),
                "ghosts        %.3f %% of the map where movers were and nothing stays",
                100 * *score.ghosts);
  table += text.data();
  if (score.ghosts_unseen > 0) {
    std::snprintf(text.data(), text.size(), ", %.3f %% in places that could not be seen since",
                  100 * score.ghosts_unseen);
    table += text.data();
  }
  return table + "\n";
}

}  // namespace ygslam
