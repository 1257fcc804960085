// Reads ROS 2 bags in SQLite (rosbag2_storage_sqlite3), messages compressed with Zstandard
// included.
#pragma once

#include <map>
#include <mutex>

#include "bag/bag.hpp"
#include "io/sqlite.hpp"

namespace ygslam {

class SqliteBag final : public Bag {
 public:
  /// @return kInput naming the file.
  static Result<std::unique_ptr<Bag>> open(const std::filesystem::path& path);

  Status visit(const Visitor& visitor, const Interrupted& interrupted) override;
  [[nodiscard]] Result<Bytes> read(const MessagePlace& place) const override;

 private:
  SqliteBag(std::filesystem::path path, sqlite::Database database)
      : path_(std::move(path)), database_(std::move(database)) {}
  [[nodiscard]] Error no_bag() const;
  Status read_topics();

  std::filesystem::path path_;
  mutable std::mutex mutex_;  // guards the database
  mutable sqlite::Database database_;
  std::map<std::int64_t, std::size_t> topic_of_;
};

}  // namespace ygslam
