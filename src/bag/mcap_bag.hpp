// Reads MCAP (mcap.dev/spec) from front to back, without its index: one that was cut off is read
// as far as it goes.
#pragma once

#include "bag/bag.hpp"
#include "bag/input_file.hpp"
#include "bag/mcap_records.hpp"

namespace ygslam {

class McapBag final : public Bag {
 public:
  explicit McapBag(InputFile file);

  Status visit(const Visitor& visitor, const Interrupted& interrupted) override;
  [[nodiscard]] Result<Bytes> read(const MessagePlace& place) const override;

 private:
  InputFile file_;
  McapRecords records_;
  mutable BlockCache blocks_;
};

}  // namespace ygslam
