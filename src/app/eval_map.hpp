// `ygslam eval --map`: a map's surface against that of the world it was made in.
#pragma once

#include <string>

#include "core/result.hpp"

namespace ygslam {

struct MapEvalArguments {
  std::string map;         ///< a PLY file, or a folder with mesh.ply or cloud.ply
  std::string truth;       ///< folder that `simulate --truth` wrote, or a PLY file of the surface
  std::string trajectory;  ///< the run's; empty: the map lies in the truth's frame
  std::string true_trajectory;  ///< empty: groundtruth.txt in the truth's folder
  double max_diff_s = 0.02;     ///< of stamps that belong together
  bool json = false;
};

/// What is to be printed. @return kInput naming the file, kUsage.
[[nodiscard]] Result<std::string> eval_map(const MapEvalArguments& arguments);

}  // namespace ygslam
