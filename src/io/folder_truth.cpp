#include "io/folder_truth.hpp"

#include <algorithm>
#include <map>
#include <vector>

#include "core/log.hpp"
#include "io/name_times.hpp"
#include "io/named_images.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kPoseEnding = ".pose";
constexpr std::size_t kMostPoses = 2'000'000;

Error truth_fault(const fs::path& path, const std::string& what) {
  return {ErrorKind::kInput, path.string() + ": " + what};
}

bool has_digits(std::string_view stem) {
  return stem.find_first_of("0123456789") != std::string_view::npos;
}

/// Stems and names of the files of poses in a folder: `*.pose.txt`, else all `.txt` with numbers.
std::map<std::string, fs::path> pose_files(const fs::path& folder, bool only_named) {
  std::map<std::string, fs::path> named;
  std::map<std::string, fs::path> others;
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code)) {
    const fs::path& path = at->path();
    const std::string stem = path.stem().string();
    if (path.extension() != ".txt" || !has_digits(stem) || others.size() > kMostPoses) continue;
    (stem.ends_with(kPoseEnding) ? named : others).emplace(stem, path);
  }
  return named.empty() && !only_named ? others : named;
}

/// Where the files of a folder's poses lie.
struct PoseFolder {
  fs::path folder;
  std::map<std::string, fs::path> files;
};
PoseFolder pose_folder_of(const fs::path& root) {
  if (PoseFolder here{root, pose_files(root, true)}; !here.files.empty()) return here;
  for (const char* name : {"poses", "pose"})
    if (PoseFolder below{root / name, pose_files(root / name, false)}; !below.files.empty())
      return below;
  return {root, {}};
}

Result<TrajectoryFile> read_pose_files(const PoseFolder& poses) {
  std::vector<std::string> stems;
  for (const auto& [stem, path] : poses.files) stems.push_back(stem);
  const auto times = times_of_names(stems);
  if (!times.ok()) return truth_fault(poses.folder, times.error().message);
  TrajectoryFile truth;
  std::size_t i = 0;
  for (const auto& [stem, path] : poses.files) {
    const auto stamp = times->stamps[i++];
    if (!stamp) continue;
    const auto text = read_file(path, std::size_t{1} << 16);
    if (!text.ok()) return text.error();
    const auto T_world_camera = parse_pose_file(*text);
    if (!T_world_camera.ok()) return truth_fault(path, T_world_camera.error().message);
    if (T_world_camera.value()) truth.poses.push_back({*stamp, **T_world_camera});
  }
  if (truth.poses.empty()) return truth_fault(poses.folder, "no pose in it is finite");
  std::ranges::stable_sort(truth.poses, {}, &StampedPose::stamp);
  truth.taken_for = "one pose a file, names taken as " + times->taken_as;
  const std::size_t left_out = poses.files.size() - truth.poses.size();
  log::info("{}: read as {}{}", poses.folder.string(), truth.taken_for,
            left_out > 0 ? ", " + std::to_string(left_out) + " without a pose" : "");
  return truth;
}

/// Replica's poses are in the order of its images.
Result<TrajectoryFile> read_replica(const fs::path& root) {
  const fs::path path = root / "traj.txt";
  auto truth = read_trajectory(path);
  if (!truth.ok() || truth->has_stamps) return truth;
  const auto files = images_at(root, {"results", "frame"});
  if (!files.ok()) return files.error();
  ListCounts counts;
  const auto images = named_images(root, *files, counts);
  if (!images.ok()) return images.error();
  if (images->images.size() != truth->poses.size())
    return truth_fault(path, std::to_string(truth->poses.size()) + " poses for " +
                                 std::to_string(images->images.size()) + " images in results/");
  for (std::size_t i = 0; i < truth->poses.size(); ++i)
    truth->poses[i].stamp = images->images[i].stamp;
  truth->has_stamps = true;
  log::info("{}: stamps are those of the images in results/", path.string());
  return truth;
}

bool is_replica(const fs::path& root) {
  std::error_code code;
  if (!fs::is_regular_file(root / "traj.txt", code)) return false;
  const auto images = images_at(root, {"results", "frame"});
  return images.ok() && !images->empty();
}

}  // namespace

Result<std::optional<SE3>> parse_pose_file(std::string_view text) {
  std::vector<double> numbers;
  bool is_finite = true;
  for (const std::string_view word : words_of(text, ",;[]\r\n")) {
    const auto number = parse_number(word);
    const std::string_view digits = word.substr(word.find_first_not_of("+-") == 1 ? 1 : 0);
    const bool is_none = digits == "inf" || digits == "nan" || digits == "Inf" || digits == "NaN";
    if (!number && !is_none)
      return Error{ErrorKind::kInput, "'" + printable(word) + "' is no number"};
    is_finite = is_finite && number.has_value();
    numbers.push_back(number.value_or(0));
    if (numbers.size() > 16) break;
  }
  if (numbers.size() != 12 && numbers.size() != 16)
    return Error{ErrorKind::kInput, "is no 4x4 matrix"};
  if (!is_finite) return std::optional<SE3>();
  auto T_world_camera = rigid_motion(numbers);
  if (!T_world_camera)
    return Error{ErrorKind::kInput, "is no pose: no rotation, or a last row that is not 0 0 0 1"};
  return T_world_camera;
}

std::optional<fs::path> truth_of_folder(const fs::path& root) {
  std::error_code code;
  if (fs::exists(root / "groundtruth.txt", code)) return root / "groundtruth.txt";
  if (!pose_folder_of(root).files.empty() || is_replica(root)) return root;
  return std::nullopt;
}

Result<TrajectoryFile> read_truth_folder(const fs::path& root) {
  std::error_code code;
  if (fs::exists(root / "groundtruth.txt", code)) return read_trajectory(root / "groundtruth.txt");
  if (const PoseFolder poses = pose_folder_of(root); !poses.files.empty())
    return read_pose_files(poses);
  if (is_replica(root)) return read_replica(root);
  if (const PoseFolder poses{root, pose_files(root, false)}; !poses.files.empty())
    return read_pose_files(poses);
  if (fs::exists(root / "trajectory.txt", code))
    return truth_fault(
        root, "no poses of a recording; did you mean " + (root / "trajectory.txt").string() + "?");
  return truth_fault(root,
                     "no poses: read are groundtruth.txt, files of 4x4 matrices (*.pose.txt, "
                     "pose/, poses/), or traj.txt beside results/");
}

}  // namespace ygslam
