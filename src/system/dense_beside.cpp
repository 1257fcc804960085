#include "system/dense_beside.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

namespace fs = std::filesystem;

/// How often a view has the depth that the keyframe of its number and stamp has at its features.
struct DepthVotes {
  int agree = 0, all = 0;
  [[nodiscard]] bool are_of_one_map() const { return 2 * agree > all; }
};

void count(const Features& features, const DepthView& view, DepthVotes& votes) {
  constexpr double kNearest_m = 0.02, kShare = 0.02;  // of it: the depth sensor's noise, and planes
  for (const Feature& feature : features.points) {
    const auto u = static_cast<int>(std::lround(feature.ideal_px.x()));
    const auto v = static_cast<int>(std::lround(feature.ideal_px.y()));
    if (!(feature.depth_m > 0) || feature.on_depth_edge || u < 0 || v < 0 ||
        u >= view.depth.width() || v >= view.depth.height() || view.depth.at(u, v) == 0)
      continue;
    const double difference_m = view.depth.at(u, v) * DepthView::kUnit_m - feature.depth_m;
    ++votes.all;
    if (std::abs(difference_m) < kNearest_m + kShare * feature.depth_m) ++votes.agree;
  }
}

bool has_tie(const Map& map, const DenseTie& tie) {
  return map.has_keyframe(tie.keyframe) && map.keyframe(tie.keyframe).data->stamp == tie.stamp;
}

/// Of a file that does not say whose it is.
bool shows_keyframes_of(const Map& map, const std::vector<SavedView>& views) {
  DepthVotes votes;
  for (const SavedView& view : views)
    if (!view.anchor && has_tie(map, tie_of(view)))
      count(*map.keyframe(view.id.keyframe).data->features, view.view->restored(), votes);
  return votes.are_of_one_map();
}

}  // namespace

std::string foreign_text(const DenseFileInfo& info, const std::optional<MapIdentity>& map) {
  if (!info.map || info.map == map) return {};
  return "is of another map, " + to_string(*info.map) + "; this one is " +
         (map ? to_string(*map) : "without a name");
}

Result<DenseBeside> load_dense_beside(const fs::path& dense_file, const Map& map,
                                      const Camera& camera) {
  const auto info = read_dense_info(dense_file);
  if (!info.ok()) return info.error();
  DenseBeside beside;
  beside.foreign = foreign_text(*info, map.identity());
  if (!beside.foreign.empty()) return beside;
  auto file = load_dense_views(dense_file, camera);
  if (!file.ok()) return file.error();
  if (!file->map && !file->views.empty() && !shows_keyframes_of(map, file->views)) {
    beside.foreign = "shows other places than this map's keyframes";
    return beside;
  }
  for (std::size_t i = 0; i < file->views.size(); ++i) {
    const DenseTie tie = tie_of(file->views[i]);
    const bool fits = has_tie(map, tie) &&
                      (!file->map || sight_of(*map.keyframe(tie.keyframe).data) == file->sights[i]);
    if (fits) beside.views.push_back(std::move(file->views[i]));
  }
  beside.left_out = file->views.size() - beside.views.size();
  return beside;
}

bool is_dense_of(const fs::path& dense_file, std::span<const MapIdentity> maps) {
  std::error_code code;
  if (!fs::exists(fs::symlink_status(dense_file, code))) return true;
  const auto info = read_dense_info(dense_file);
  return info.ok() && info->map && std::ranges::find(maps, *info->map) != maps.end();
}

Result<fs::path> put_aside(const fs::path& dense_file) {
  std::error_code code;
  fs::path aside;
  int number = 1;
  do {
    aside = dense_file;
    aside += "." + std::to_string(number++);
  } while (fs::exists(fs::symlink_status(aside, code)));
  fs::rename(dense_file, aside, code);
  if (code) return Error{ErrorKind::kOutput, dense_file.string() + ": " + code.message()};
  return aside;
}

}  // namespace ygslam
