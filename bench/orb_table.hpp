// Repeatability and correct matches of ORB extractors at equal count.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "features/feature.hpp"
#include "image/image.hpp"

namespace ygslam::bench {

/// @param count features wanted. @return at most that many.
using Extract = std::function<Features(const GreyImage& image, int count)>;

struct Candidate {
  std::string name;
  Extract extract;
};

/// OpenCV's ORB (8 levels, 1.2, Harris score) behind our types.
[[nodiscard]] Features extract_with_opencv(const GreyImage& image, int count);

/// Prints a table for synthetic warps (exact truth) of rendered pictures and of frames of the
/// sequences, and for pairs of frames `gap` apart of each sequence (truth: depth and poses).
/// @param sequences folders in TUM layout. @return exit code; 4 if a sequence cannot be read.
int print_tables(const std::vector<Candidate>& candidates,
                 const std::vector<std::string>& sequences, int count, int gap);

}  // namespace ygslam::bench
