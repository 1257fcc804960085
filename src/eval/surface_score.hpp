// A reconstructed surface judged against the true one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "eval/object_score.hpp"

namespace ygslam {

/// Triangles, or points where there are none; all in one frame [m].
struct Surface {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of points
};

/// Distance of each query to the nearest place of the surface [m]: of its triangles, or of its
/// points where it has none. @param surface not empty.
[[nodiscard]] std::vector<float> distances_to(const Surface& surface,
                                              std::span<const Eigen::Vector3f> queries);

/// Evenly spread over the triangles, one on spacing_m^2; of a surface without triangles its points.
/// The same for the same surface.
[[nodiscard]] std::vector<Eigen::Vector3f> sample_surface(const Surface& surface, double spacing_m);

/// How many that would be.
[[nodiscard]] double sample_count(const Surface& surface, double spacing_m);

struct SurfaceTruth {
  Surface surface;                    ///< of all that stays where it is; not empty
  std::vector<Eigen::Vector3f> seen;  ///< what of it a map can hold; not empty
  /// Where movers' surfaces were; nothing: unknown.
  std::optional<std::vector<Eigen::Vector3f>> movers = {};
  /// What came to where it stands, and is not of `surface`: the map is not judged there.
  std::vector<UprightBox> moved = {};
  /// Places that things left and that could not be seen since.
  std::vector<UprightBox> left_unseen = {};
};

struct SurfaceScoreOptions {
  double within_m = 0.05;
  double spacing_m = 0.02;  ///< of samples of the map's triangles
  double margin_m = 0.1;    ///< around the truth's boxes
};

/// Shares are 0 to 1; all are 0 of a map without points.
struct SurfaceScore {
  SurfaceScoreOptions options;
  std::size_t samples = 0, truth_samples = 0;
  double mean_m = 0, median_m = 0;  ///< distance of the map's samples to the true surface
  double precision = 0;             ///< share of them within options.within_m
  double completeness = 0;          ///< share of truth.seen that the map comes so near to
  double f1 = 0;                    ///< harmonic mean of both
  /// Share of the samples farther from the true surface than that, but so near to where movers
  /// were.
  std::optional<double> ghosts;
  double ghosts_unseen = 0;  ///< of that share: in truth.left_unseen
};
[[nodiscard]] SurfaceScore score_surface(const Surface& map, const SurfaceTruth& truth,
                                         const SurfaceScoreOptions& options = {});

[[nodiscard]] nlohmann::json to_json(const SurfaceScore& score);
/// For people, under a heading.
[[nodiscard]] std::string format_surface(const SurfaceScore& score, const std::string& name);

}  // namespace ygslam
