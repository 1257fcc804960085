// A recording of messages, whatever its container: ROS 2 bags (MCAP, sqlite3) and ROS 1 bags.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "bag/cdr.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

namespace ygslam {

inline constexpr std::size_t kMostTopics = 10'000;
/// Names of other people's files, which may be as long as a file: not longer than a topic's.
[[nodiscard]] std::string cut_name(std::string name);

/// Whether a type's name says that it holds pictures, whoever reads it.
[[nodiscard]] bool shows_images(std::string_view type);

struct BagTopic {
  std::string name;
  std::string type;  ///< as ROS 1 names it: sensor_msgs/Image
  Layout layout = Layout::kCdr;
  bool operator==(const BagTopic&) const = default;
};

/// Where a message lies; what the numbers mean is the bag's own affair.
struct MessagePlace {
  std::size_t file = 0;  ///< of a bag of several files
  std::uint64_t block = 0, offset = 0, bytes = 0;
};

struct BagMessage {
  std::size_t topic = 0;  ///< position in topics()
  Timestamp logged;       ///< when it was recorded
  std::span<const std::uint8_t> bytes;
  MessagePlace place;
};

using MessageVisitor = std::function<void(const BagMessage&)>;

/// What a reader of messages has met: topics and faults.
class MessageReader {
 public:
  /// Those met so far.
  [[nodiscard]] const std::vector<BagTopic>& topics() const { return topics_; }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 protected:
  /// @param type "sensor_msgs/msg/Image" or "sensor_msgs/Image".
  std::size_t add_topic(const std::string& name, const std::string& type, Layout layout);

  [[nodiscard]] static Error interruption(const std::filesystem::path& path) {
    return {ErrorKind::kInput, path.string() + ": interrupted while it was read through"};
  }
  /// Something that is left out.
  void note(const std::string& fault);
  /// At the end: one warning of all that was noted.
  void warn_of_faults(const std::string& source);

  std::vector<BagTopic> topics_;
  std::vector<std::string> warnings_;

 private:
  std::map<std::tuple<std::string, std::string, Layout>, std::size_t> place_of_topic_;
  std::size_t faults_ = 0;
  std::string first_fault_;
};

class Bag : public MessageReader {
 public:
  using Visitor = MessageVisitor;
  using Interrupted = std::function<bool()>;
  virtual ~Bag() = default;

  /// Hands every readable message to `visitor`, in the order of the file. What cannot be read is
  /// passed over and told in warnings(). To be called once.
  /// @param interrupted asked from time to time; may be empty.
  /// @return kInput, naming the file, where nothing can be made of it, or it is interrupted.
  virtual Status visit(const Visitor& visitor, const Interrupted& interrupted) = 0;
  /// A message met by visit(). May be called from several threads at once.
  /// @return kInput with a reason alone.
  [[nodiscard]] virtual Result<Bytes> read(const MessagePlace& place) const = 0;
};

/// Whether a path is a bag: by the first bytes of a file; a folder is one with metadata.yaml, or
/// with files of bags in it, unless it has lists of images or folders of them.
[[nodiscard]] bool is_bag(const std::filesystem::path& path);

/// @return kInput naming the file, where it cannot be read or is no bag.
[[nodiscard]] Result<std::unique_ptr<Bag>> open_bag(const std::filesystem::path& path);

}  // namespace ygslam
