#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/check.hpp"
#include "map_file/map_file.hpp"
#include "map_file/map_store.hpp"
#include "map_file/replace_file.hpp"
#include "map_file/save_new.hpp"

namespace ygslam {
namespace fs = std::filesystem;

struct MapWriter::State {
  std::optional<OutputLock> lock;  // longer than the store
  map_file::MapStore store;
};

MapWriter::MapWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
MapWriter::MapWriter(MapWriter&&) noexcept = default;
MapWriter& MapWriter::operator=(MapWriter&&) noexcept = default;
MapWriter::~MapWriter() = default;

Result<MapWriter> MapWriter::open(const fs::path& path, const Camera& camera,
                                  const PyramidScales& scales) {
  const auto target = map_file::target_of(path);
  if (!target) return target.error();
  auto lock = map_file::lock_map(*target);
  if (!lock) return lock.error();
  std::error_code code;
  // A map from the first moment on: whenever the process ends, there is something to open.
  if (!fs::exists(*target, code)) {
    Status made =
        map_file::save_new(*target, Map(scales), map_file::new_info(camera.config(), scales));
    if (!made) return made.error();
  }
  // Not only at the end of a long run.
  if (::faccessat(AT_FDCWD, target->c_str(), W_OK, AT_EACCESS) != 0)
    return Error{ErrorKind::kOutput, path.string() + ": " + std::strerror(errno)};
  fs::path journal = *target;
  journal += "-journal";
  if (fs::exists(journal, code))  // SQLite would take it for the file's own and roll it back
    return Error{ErrorKind::kOutput, journal.string() + ": is of no map; remove it"};
  auto opened = map_file::open_map(*target);
  if (!opened) return opened.error();
  if (const auto differ = map_file::differences(opened->meta.info, camera.config(), scales);
      !differ.empty())
    return Error{ErrorKind::kSavedMap, path.string() + ": made with " + differ};
  map_file::Meta meta = std::move(opened->meta);
  (void)opened->database.close();
  auto store = map_file::MapStore::go_on(*target, std::move(meta));
  if (!store) return store.error();
  return MapWriter(std::make_unique<State>(State{std::move(*lock), std::move(*store)}));
}

Status MapWriter::write(const Map& map) {
  CHECK(state_, "write after close");
  return state_->store.write(map);
}

Status MapWriter::close() {
  CHECK(state_, "close twice");
  Status closed = state_->store.close();
  state_.reset();
  return closed;
}

}  // namespace ygslam
