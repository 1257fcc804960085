// Who takes the messages of a run: a recording, the live page.
#pragma once

#include <cstdint>
#include <string_view>

#include "bag/cdr.hpp"
#include "core/time.hpp"

namespace ygslam {

class MessageSink {
 public:
  virtual ~MessageSink() = default;
  /// Whether a message of this topic would be of use now: else it is not made.
  [[nodiscard]] virtual bool wants(std::string_view topic) const = 0;
  /// @param type ROS 2 type, see ros::schema_of(). @param part of what the topic shows: where
  /// messages show a part each, the newest of each part counts.
  virtual void put(std::string_view topic, const char* type, Timestamp stamp, Bytes cdr,
                   std::uint32_t part) = 0;
};

}  // namespace ygslam
