// Reads MCAP (mcap.dev/spec) from front to back, without its index: one that was cut off is read
// as far as it goes.
#pragma once

#include <map>

#include "bag/bag.hpp"
#include "bag/input_file.hpp"

namespace ygslam {

class McapBag final : public Bag {
 public:
  explicit McapBag(InputFile file);

  Status visit(const Visitor& visitor) override;
  [[nodiscard]] Result<Bytes> read(const MessagePlace& place) const override;

 private:
  void visit_records(std::span<const std::uint8_t> records, std::uint64_t chunk,
                     const Visitor& visitor);
  void take_record(std::uint8_t opcode, std::span<const std::uint8_t> content, MessagePlace place,
                   const Visitor& visitor);
  void add_channel(std::span<const std::uint8_t> content);

  struct Schema {
    std::string name, encoding;
  };
  InputFile file_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, std::optional<std::size_t>> topic_of_;  // none: of another encoding
  mutable BlockCache blocks_;
};

}  // namespace ygslam
