#include <array>
#include <cmath>

#include "scene/class_colour.hpp"
#include "scene_file/npz_file.hpp"
#include "scene_file/space_file.hpp"

namespace ygslam {
namespace {

template <typename T>
std::string_view bytes_of(const T& value) {
  static_assert(std::is_trivially_copyable_v<T> && std::endian::native == std::endian::little);
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

// Names as NumPy keeps text of fixed length: UTF-32, filled up with zeros.
constexpr std::size_t kLongestName = 16;

std::array<char32_t, kLongestName> padded_name(SemanticClass semantic_class) {
  const std::string name = semantic_class_name(semantic_class);
  CHECK(name.size() <= kLongestName, "a class of a longer name");
  std::array<char32_t, kLongestName> padded{};
  std::copy(name.begin(), name.end(), padded.begin());
  return padded;
}

void add_label_names(NpzFile& file) {
  const auto classes = all_semantic_classes();
  const std::array<std::size_t, 1> shape{classes.size()};
  file.add_array("label_ids", "<u2", shape, [&](const NpzFile::ByteSink& sink) {
    for (const SemanticClass c : classes) sink(bytes_of(static_cast<std::uint16_t>(c)));
  });
  file.add_array("label_names", "<U" + std::to_string(kLongestName), shape,
                 [&](const NpzFile::ByteSink& sink) {
                   for (const SemanticClass c : classes) sink(bytes_of(padded_name(c)));
                 });
}

}  // namespace

Status write_voxels(const std::filesystem::path& path, const SpaceCells& space) {
  CHECK(space.cell_m > 0);
  auto file = NpzFile::create(path);
  if (!file.ok()) return file.error();
  const auto known = [](const SpaceCell& cell) { return cell.state != SpaceState::kUnknown; };
  const auto count =
      static_cast<std::size_t>(std::count_if(space.cells.begin(), space.cells.end(), known));
  // @param value of a cell, as it goes into the file. @param columns 1: a list of numbers.
  const auto add = [&](std::string_view name, std::string_view type, std::size_t columns,
                       const auto& value) {
    const std::array<std::size_t, 2> shape{count, columns};
    file->add_array(name, type, std::span(shape).first(columns > 1 ? 2 : 1),
                    [&](const NpzFile::ByteSink& sink) {
                      for (const SpaceCell& cell : space.cells)
                        if (known(cell)) sink(bytes_of(value(cell)));
                    });
  };
  file->add_array("cell_m", "<f8", {},
                  [&](const NpzFile::ByteSink& sink) { sink(bytes_of(space.cell_m)); });
  add("index", "<i4", 3, [](const SpaceCell& cell) {
    return std::array<std::int32_t, 3>{cell.index.x(), cell.index.y(), cell.index.z()};
  });
  add("state", "|u1", 1, [](const SpaceCell& cell) { return cell.state; });
  add("log_odds", "<f4", 1, [](const SpaceCell& cell) {
    CHECK(std::isfinite(cell.log_odds) && std::isfinite(cell.label.probability),
          "a cell that is not finite must not be written");
    return cell.log_odds;
  });
  add("colour", "|u1", 3, [](const SpaceCell& cell) { return cell.colour; });
  add("label", "<u2", 1,
      [](const SpaceCell& cell) { return static_cast<std::uint16_t>(cell.label.semantic_class); });
  add("instance", "<u2", 1,
      [](const SpaceCell& cell) { return static_cast<std::uint16_t>(cell.label.object); });
  add("prob", "<f4", 1, [](const SpaceCell& cell) { return cell.label.probability; });
  add_label_names(*file);
  return file->commit();
}

}  // namespace ygslam
