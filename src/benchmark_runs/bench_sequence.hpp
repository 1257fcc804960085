// The sequences of a folder: what they are, and whether they can be used.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "eval/path_statistics.hpp"

namespace ygslam {

struct BenchSequence {
  std::string id;    ///< safe as a folder's name, unique in a sweep
  std::string name;  ///< relative to the root, as a person knows it
  std::filesystem::path folder;
  std::string kind;                      ///< "tum", "bonn", "rendered" or "folder"
  std::optional<std::string> paper_row;  ///< its row of the paper's tables, e.g. "fr3_walking_xyz"
  std::size_t frames = 0;                ///< pairs listed
  double duration_s = 0;                 ///< from the first pair to the last
  std::optional<std::filesystem::path> groundtruth;
  std::optional<PathStatistics> truth;  ///< of the true poses at the time of the frames
  std::string fingerprint;              ///< of lists, camera, truth and the images' sizes
  std::string masks_fingerprint;        ///< of recorded masks; empty where the sweep reads none
  std::optional<std::string> error;     ///< why it cannot be used, one line
};

/// Folders below root (root itself may be one) that are meant to be sequences in TUM layout: with
/// one of the lists, or with rgb and depth. Not searched: hidden folders, results of `ygslam
/// bench`, what lies inside a sequence. In order of their names; only id, name and folder are
/// filled in.
/// @return kInput: no such folder, or no sequence in it.
[[nodiscard]] Result<std::vector<BenchSequence>> find_sequences(const std::filesystem::path& root);

/// Those of the given names (or ids, or last parts of names), in the order found.
/// @return kUsage for a name that none has, naming the nearest.
[[nodiscard]] Result<std::vector<BenchSequence>> select_sequences(
    const std::vector<BenchSequence>& found, const std::vector<std::string>& names);

/// Reads lists, camera and truth and fills in the rest. What cannot be read becomes `error`; a
/// truth that cannot be used does not: the runs will say so.
void inspect_sequence(BenchSequence& sequence);

/// Of all mask images and instances.json in a folder, by name and content; "none" without folder.
[[nodiscard]] std::string fingerprint_of_masks(const std::filesystem::path& folder);

/// The row of the paper's tables that a recording of TUM belongs to, by its name, e.g.
/// rgbd_dataset_freiburg3_walking_xyz, fr3_walking_xyz, fr3_w_xyz; parts and variants have none.
[[nodiscard]] std::optional<std::string> paper_row_of(const std::string& name);

/// Text with the folder of the sequence replaced by its name.
[[nodiscard]] std::string without_folder(std::string text, const BenchSequence& sequence);

}  // namespace ygslam
