// Recordings in MCAP (mcap.dev/spec), which Foxglove, Lichtblick, Rerun and ROS 2 open: chunks
// compressed with Zstandard, with an index at the end. A file whose writer died is readable up to
// its last chunk.
#pragma once

#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bag/ros_messages.hpp"
#include "core/result.hpp"
#include "io/growing_file.hpp"

namespace ygslam {

class McapWriter {
 public:
  /// Whether create() can be expected to do; nothing is written. @return its errors.
  static Status check(const std::filesystem::path& path);
  /// Replaces an older recording of that name, or that which a link of that name leads to.
  /// @return kOutput if the file cannot be written, or is there and no recording.
  static Result<McapWriter> create(const std::filesystem::path& path);

  /// @param type of the topic, which stays the same; see ros::schema_of().
  /// @return kOutput, from the first write that failed on.
  Status write(const std::string& topic, const std::string& type, Timestamp stamp,
               const Bytes& cdr);
  /// Puts what is not in the file yet there, so that it survives what may come.
  Status flush();
  /// The index. Nothing may be written afterwards.
  Status finish();

 private:
  struct Entry {  // of a chunk's index
    std::int64_t ns;
    std::uint64_t offset;
  };
  struct ChunkPlace {
    std::int64_t first_ns, last_ns;
    std::uint64_t offset, bytes, index_bytes, compressed, uncompressed;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
  };

  McapWriter(std::filesystem::path path, FilePtr file);
  std::uint16_t add_channel(const std::string& topic, const std::string& type);
  Status put(const Bytes& bytes);
  Status close_chunk();

  std::filesystem::path path_;
  FilePtr file_;
  std::uint64_t at_ = 0;  // bytes in the file
  Bytes chunk_;
  std::map<std::uint16_t, std::vector<Entry>> chunk_index_;
  std::vector<ChunkPlace> chunks_;
  std::map<std::string, std::uint16_t> channel_of_, schema_of_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::vector<Bytes> schemas_, channels_;  // records, again at the end
  std::optional<Error> failed_;
};

}  // namespace ygslam
