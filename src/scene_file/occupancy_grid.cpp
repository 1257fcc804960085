#include "scene_file/occupancy_grid.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "io/piece_file.hpp"
#include "scene/floor_frame.hpp"

namespace ygslam {
namespace {

enum class Evidence { kFloor, kObstacle };

std::optional<Evidence> evidence_of(const SpaceCell& cell, double height_m,
                                    const GridOptions& options) {
  if (cell.state == SpaceState::kUnknown) return {};
  // A floor that was laid a little too high or too low is one all the same; a pit is none.
  if (height_m < -options.floor_seen_m) return {};
  const bool low = height_m < options.floor_seen_m;
  if (cell.state == SpaceState::kFree) return low ? std::optional(Evidence::kFloor) : std::nullopt;
  if (cell.label.semantic_class == SemanticClass::kCeiling) return {};
  if (cell.label.semantic_class == SemanticClass::kFloor && low) return Evidence::kFloor;
  if (height_m < options.obstacle_min_m) return Evidence::kFloor;
  return height_m <= options.obstacle_max_m ? std::optional(Evidence::kObstacle) : std::nullopt;
}

// Calls visit(column, row, evidence) for what the cells say; rows grow with y. A cell that stands
// askew to the grid touches several of its pixels: an eighth of it is looked at at a time, so that
// no pixel under a surface is left out.
template <typename Visit>
void visit_evidence(const SpaceCells& space, const SE3& T_floor_world, const GridOptions& options,
                    const Visit& visit) {
  std::array<Vec3, 8> offsets;
  for (std::size_t i = 0; i < 8; ++i) {
    const Vec3 corner((i & 1) ? 0.25 : -0.25, (i & 2) ? 0.25 : -0.25, (i & 4) ? 0.25 : -0.25);
    offsets[i] = T_floor_world.R() * corner;
  }
  for (const SpaceCell& cell : space.cells) {
    const Vec3 centre = (cell.index.cast<double>().array() + 0.5) * space.cell_m;
    const Vec3 c_cells = T_floor_world * centre / space.cell_m;
    for (const Vec3& offset : offsets) {
      const Vec3 p_cells = c_cells + offset;
      const auto evidence = evidence_of(cell, p_cells.z() * space.cell_m, options);
      if (!evidence) continue;
      visit(static_cast<std::int64_t>(std::floor(p_cells.x())),
            static_cast<std::int64_t>(std::floor(p_cells.y())), *evidence);
    }
  }
}

std::string yaml_list(const auto& numbers) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(9);
  for (const double number : numbers) text << (text.tellp() > 0 ? ", " : "[") << number + 0.0;
  return text.str() + "]";
}

}  // namespace

Result<OccupancyGrid> make_occupancy_grid(const SpaceCells& space, const Gravity& gravity,
                                          const GridOptions& options) {
  CHECK(space.cell_m > 0 && options.obstacle_min_m <= options.obstacle_max_m);
  OccupancyGrid grid;
  grid.resolution_m = space.cell_m;
  grid.T_world_floor = T_world_floor(gravity);
  const SE3 T_floor_world = grid.T_world_floor.inverse();

  constexpr std::int64_t kFar = std::int64_t{1} << 40;
  std::int64_t left = kFar, right = -kFar, bottom = kFar, top = -kFar;
  visit_evidence(space, T_floor_world, options, [&](std::int64_t x, std::int64_t y, Evidence) {
    left = std::min(left, x);
    right = std::max(right, x);
    bottom = std::min(bottom, y);
    top = std::max(top, y);
  });
  if (left > right) left = right = bottom = top = 0;
  constexpr std::int64_t kMostPixels = std::int64_t{1} << 26;
  const std::int64_t width = right - left + 1, height = top - bottom + 1;
  if (width > kMostPixels || height > kMostPixels || width * height > kMostPixels) {
    return Error{ErrorKind::kOutput, "a ground plan of " + std::to_string(width) + " x " +
                                         std::to_string(height) + " pixels is too large"};
  }
  grid.origin_floor = Vec2(static_cast<double>(left), static_cast<double>(bottom)) * space.cell_m;
  grid.shades = GreyImage(static_cast<int>(width), static_cast<int>(height), kGridUnknown);
  visit_evidence(
      space, T_floor_world, options, [&](std::int64_t x, std::int64_t y, Evidence evidence) {
        auto& shade = grid.shades.at(static_cast<int>(x - left), static_cast<int>(top - y));
        if (evidence == Evidence::kObstacle) shade = kGridOccupied;
        if (evidence == Evidence::kFloor && shade == kGridUnknown) shade = kGridFree;
      });
  return grid;
}

Status write_occupancy_grid(const std::filesystem::path& yaml, const OccupancyGrid& grid) {
  const std::filesystem::path image = std::filesystem::path(yaml).replace_extension(".pgm");
  auto file = PieceFile::create(image);
  if (!file.ok()) return file.error();
  file->add("P5\n" + std::to_string(grid.shades.width()) + " " +
            std::to_string(grid.shades.height()) + "\n255\n");
  for (int v = 0; v < grid.shades.height(); ++v) {
    file->add({reinterpret_cast<const char*>(grid.shades.row(v)),
               static_cast<std::size_t>(grid.shades.width())});
  }
  if (Status written = file->commit(); !written.ok()) return written;

  const Vec3& t = grid.T_world_floor.t();
  const Eigen::Quaterniond q = grid.T_world_floor.quaternion();
  // 205 is 0.19608 of the way to black: free_thresh must be less, or unknown reads as free.
  // JSON's quoted text is YAML's, too.
  const std::string name = nlohmann::json(image.filename().string())
                               .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string text = "image: " + name + "\nmode: trinary\nresolution: ";
  text += yaml_list(std::array{grid.resolution_m}).substr(1);
  text.back() = '\n';
  text += "origin: " + yaml_list(std::array{grid.origin_floor.x(), grid.origin_floor.y(), 0.0}) +
          "\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n" +
          "# Pose of this grid's frame (z up, floor at 0) in the world of the other files.\n" +
          "world_from_map:\n  translation_m: " + yaml_list(std::array{t.x(), t.y(), t.z()}) +
          "\n  rotation_xyzw: " + yaml_list(std::array{q.x(), q.y(), q.z(), q.w()}) + "\n";
  return write_file_atomically(yaml, text);
}

}  // namespace ygslam
