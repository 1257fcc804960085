#include "io/atomic_file.hpp"
#include "map_file/map_file.hpp"
#include "map_file/map_store.hpp"
#include "map_file/replace_file.hpp"
#include "map_file/save_new.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace map_file {
namespace {

constexpr std::size_t kLongestName = 255;  // of a file, in bytes

/// Removes a file unless told that it is finished.
class Unfinished {
 public:
  explicit Unfinished(fs::path path) : path_(std::move(path)) {}
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  ~Unfinished() {
    if (path_.empty()) return;
    std::error_code ignored;
    fs::remove(path_, ignored);
    remove_companions(path_);
  }
  void finished() { path_.clear(); }

 private:
  fs::path path_;
};

/// What is there already must be a map, or nothing: whoever mistypes a name loses no other file.
Status check_old_file(const fs::path& target) {
  std::error_code code;
  const auto bytes = fs::file_size(target, code);
  if (code || bytes == 0) return Ok{};
  if (has_map_header(target)) return Ok{};
  return Error{ErrorKind::kOutput, target.string() + ": is there and is no map: not replaced"};
}

/// A log that a killed run left belongs to the old file and would spoil the new one.
void settle_old_log(const fs::path& target) {
  fs::path log = target;
  log += "-wal";
  std::error_code code;
  if (!fs::exists(log, code)) return;
  if (auto old = Database::open(target, Database::Access::kWrite)) {
    (void)old->run("PRAGMA wal_checkpoint(TRUNCATE)");
    (void)old->close();
  }
  remove_companions(target);
}

}  // namespace

Status save_new(const fs::path& target, const Map& map, MapFileInfo info) {
  if (Status old = check_old_file(target); !old) return old;
  const auto temporary = unused_name_beside(target);
  if (!temporary) return temporary.error();
  Unfinished unfinished(*temporary);
  const auto named = [&](const Error& error) {  // after the file the user knows
    const std::string name = temporary->string();
    std::string message = error.message;
    if (const auto at = message.find(name); at != std::string::npos)
      message.replace(at, name.size(), target.string());
    return Error{error.kind, message};
  };
  {
    auto store = MapStore::create(*temporary, std::move(info));
    if (!store) return named(store.error());
    if (Status written = store->write(map); !written) return named(written.error());
    if (Status closed = store->close(); !closed) return named(closed.error());
  }
  settle_old_log(target);
  if (Status replaced = replace_file(*temporary, target); !replaced) return replaced;
  unfinished.finished();
  return Ok{};
}

Result<std::optional<OutputLock>> lock_map(const fs::path& target) {
  std::optional<OutputLock> lock;
  // No writer works on a name to which it could not add the name of its log.
  if (target.filename().string().size() + 5 > kLongestName) return lock;
  auto acquired = OutputLock::acquire_beside(target);
  if (!acquired) return acquired.error();
  lock.emplace(std::move(*acquired));
  return lock;
}

}  // namespace map_file

Status save_map(const fs::path& path, const Map& map, const Camera& camera) {
  const auto target = map_file::target_of(path);
  if (!target) return target.error();
  const auto lock = map_file::lock_map(*target);
  if (!lock) return lock.error();
  return map_file::save_new(*target, map, map_file::new_info(camera.config(), map.scales()));
}

}  // namespace ygslam
