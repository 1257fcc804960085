// Reads MCAP (mcap.dev/spec) from front to back, without its index: one that was cut off is read
// as far as it goes. Several may follow each other, as a stream that was kept has them.
#pragma once

#include <optional>

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
  bool visit_record(const Bytes& head, std::uint64_t& at, const Visitor& visitor,
                    ExpansionLimit& expansion);
  [[nodiscard]] std::uint64_t beginning_behind(std::uint64_t at) const;
  [[nodiscard]] std::optional<std::uint64_t> beginning_after(std::uint64_t at) const;

  InputFile file_;
  McapRecords records_;
  std::size_t recordings_ = 1;
  bool has_ended_ = false;  // the records of the last one
  mutable BlockCache blocks_;
};

}  // namespace ygslam
