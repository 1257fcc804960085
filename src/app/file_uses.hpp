// Which files a command reads and which it writes, by what the user called them: no file has two
// uses, whatever name, link or hard link it goes by.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "io/sequence.hpp"

namespace ygslam {

class FileUses {
 public:
  /// Names of files below a folder. A star stands for anything: "rgb/*.png".
  using Names = std::vector<std::string_view>;

  /// @param what the option or argument that names it. An empty path is none.
  void reads(const std::string& what, const std::filesystem::path& file);
  /// With what lies beside a map under its name.
  void reads_map(const std::string& what, const std::filesystem::path& map);
  void reads_in(const std::string& what, const std::filesystem::path& folder, const Names& names);
  /// Images, lists, or the files of a bag.
  void reads_sequence(const std::string& given, const Sequence& sequence);

  /// A link is followed.
  void writes(const std::string& what, const std::filesystem::path& file);
  void writes_map(const std::string& what, const std::filesystem::path& map);
  void writes_in(const std::string& what, const std::filesystem::path& folder, const Names& names);

  /// @return kUsage naming a file that has two uses and the options that give them.
  [[nodiscard]] Status check() const;

 private:
  struct Place {
    std::string what;
    std::filesystem::path given;                                        ///< for messages
    std::filesystem::path folder;                                       ///< without links
    std::string name;                                                   ///< perhaps with a star
    std::optional<std::pair<std::uint64_t, std::uint64_t>> identity{};  ///< device, number
    bool is_of_folder = false;  ///< which was named, not the file

    [[nodiscard]] std::filesystem::path path() const { return folder / name; }
    [[nodiscard]] bool is_one() const { return name.find('*') == name.npos; }
  };
  static Place place_of_file(const std::string& what, const std::filesystem::path& file);
  static std::vector<Place> places_of_map(const std::string& what,
                                          const std::filesystem::path& map);
  static std::vector<Place> places_in(const std::string& what, const std::filesystem::path& folder,
                                      const Names& names);
  static bool meet(const Place& a, const Place& b);
  /// A file where another use has a folder.
  static bool is_in_the_way(const Place& file, const Place& other);

  std::vector<Place> read_, written_;
};

/// What `ygslam run` keeps in its folder.
[[nodiscard]] inline FileUses::Names run_files() {
  return {"trajectory.txt", "trajectory_live.txt", "keyframes.txt", "frames.csv",
          "odometry.txt",   "objects.csv",         "loops.csv",     "map.ply",
          "metrics.json",   "config.yaml",         "log.txt",       ".lock"};
}
/// A scene of --export.
[[nodiscard]] inline FileUses::Names scene_files() {
  return {"cloud.ply", "cloud.pcd", "mesh.ply", "mesh.glb",     "space.bt",
          "space.ot",  "grid.yaml", "grid.pgm", "objects.json", "labels.json"};
}

}  // namespace ygslam
