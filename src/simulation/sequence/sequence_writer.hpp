// A sequence as files in TUM layout, with the truth folders of the contract.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "simulation/sequence/sequence_source.hpp"
#include "simulation/sequence/true_objects.hpp"

namespace ygslam::sim {

struct WriteOptions {
  bool jpeg = true;    ///< colour as JPEG of quality 95, otherwise PNG
  bool truth = false;  ///< the truth images
};

/// Writes frame by frame. The lists (rgb.txt, depth.txt, associations.txt, groundtruth.txt,
/// calibration.txt) come last: without them the images are no sequence, so that what was broken off
/// cannot be taken for whole.
class SequenceWriter {
 public:
  /// Creates the folders and removes lists of an earlier sequence.
  /// @return kOutput if the folder cannot be written.
  [[nodiscard]] static Result<SequenceWriter> create(const std::filesystem::path& folder,
                                                     const SequenceSource& source,
                                                     const WriteOptions& options);
  Status add(const SimulatedFrame& frame, const SequenceSource& source);
  /// Writes the lists and the static scene.
  Status finish(const SequenceSource& source);

 private:
  SequenceWriter(std::filesystem::path folder, const WriteOptions& options)
      : folder_(std::move(folder)), options_(options) {}
  Status put(const std::filesystem::path& name, const std::string& bytes) const;
  Status add_truth(const SimulatedFrame& frame, const std::string& stamp);

  std::filesystem::path folder_;
  WriteOptions options_;
  std::string colour_list_, depth_list_, pairs_, poses_;
  std::map<std::string, std::string> mover_poses_;
  TrueObjects objects_;
};

/// Writes a file anew: whole or not at all, and through no link. @return kOutput naming the path.
[[nodiscard]] Status write_new_file(const std::filesystem::path& path, const std::string& bytes);

/// The fixed scene as a binary PLY mesh with a colour per vertex.
[[nodiscard]] std::string static_mesh_ply(const Scene& scene);

}  // namespace ygslam::sim
