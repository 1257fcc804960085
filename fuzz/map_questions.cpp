#include "fuzz/map_questions.hpp"

#include "core/check.hpp"
#include "map/map_bytes.hpp"
#include "map_file/map_file.hpp"

namespace ygslam::fuzz {
namespace {

template <typename T>
void require(const Result<T>& result) {
  CHECK(result.ok(), result.ok() ? "" : result.error().message.c_str());
}

}  // namespace

void ask_map_file(const std::filesystem::path& path) {
  const auto map = load_map(path);
  const std::filesystem::path rest = path.string() + ".rest";
  const auto recovered = recover_map(path, rest);
  CHECK(map.ok() == (recovered.ok() && recovered->found.faults.empty()));
  if (recovered.ok()) {
    const auto saved = load_map(rest);
    require(saved);
    CHECK(saved->keyframes().size() == recovered->keyframes);
    CHECK(!map.ok() || to_bytes(*saved) == to_bytes(*map));
    std::filesystem::remove(rest);
  }
  if (!map.ok()) return;
  const Camera camera(recovered->found.info.camera);
  auto writer = MapWriter::open(path, camera, map->scales());
  require(writer);
  require(writer->write(*map));
  require(writer->close());
  const auto written = load_map(path, camera, map->scales());
  require(written);
  CHECK(to_bytes(*written) == to_bytes(*map));
}

}  // namespace ygslam::fuzz
