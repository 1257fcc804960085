// Reads ROS 1 bags (wiki.ros.org/Bags/Format/2.0) from front to back, without their index: one that
// was never closed, or cut off, is read as far as it goes.
#pragma once

#include <map>

#include "bag/bag.hpp"
#include "bag/input_file.hpp"

namespace ygslam {

class Ros1Bag final : public Bag {
 public:
  explicit Ros1Bag(InputFile file);

  Status visit(const Visitor& visitor, const Interrupted& interrupted) override;
  [[nodiscard]] Result<Bytes> read(const MessagePlace& place) const override;

 private:
  void visit_records(std::span<const std::uint8_t> records, std::uint64_t chunk,
                     const Visitor& visitor);

  InputFile file_;
  std::map<std::uint32_t, std::size_t> topic_of_;  // by connection
  mutable BlockCache blocks_;
};

}  // namespace ygslam
