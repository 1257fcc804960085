// Where in the map a view was taken: candidates of the index, each verified.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "loop/place_index.hpp"
#include "loop/place_verifier.hpp"

namespace ygslam {

struct PlaceFinderConfig {
  PlaceVerifierConfig verifier;
  std::size_t places = 3;  ///< verified at most
  /// Another place that agrees with so many times the inliers of the best makes it ambiguous.
  double ambiguous_share = 0.7;
};

struct FoundPlace {
  double score = 0;  ///< of the index
  PlaceMatch match;
};

class PlaceFinder {
 public:
  PlaceFinder(const PlaceFinderConfig& config, const Camera& camera)
      : config_(config), verifier_(config.verifier, camera) {}

  /// @param excluded keyframes that are no answer. @param seed of the sampling.
  /// @return the best candidates with what speaks for and against each.
  [[nodiscard]] std::vector<FoundPlace> find(const Map& map, const PlaceIndex& index,
                                             const PlaceView& view,
                                             std::span<const KeyframeId> excluded,
                                             std::uint64_t seed) const;
  /// Whether one place fits about as well as another that is somewhere else.
  [[nodiscard]] bool rivals(const PlaceMatch& best, const PlaceMatch& other) const;
  /// The one place that agrees; nullopt if none does, or several that differ.
  [[nodiscard]] std::optional<PlaceMatch> find_one(const Map& map, const PlaceIndex& index,
                                                   const PlaceView& view, std::uint64_t seed) const;

  [[nodiscard]] const PlaceVerifier& verifier() const { return verifier_; }

 private:
  PlaceFinderConfig config_;
  PlaceVerifier verifier_;
};

}  // namespace ygslam
