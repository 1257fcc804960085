// Images of a bag whose clocks were set while it was recorded.
#pragma once

#include <optional>
#include <vector>

#include "bag/bag_images.hpp"
#include "bag/stamp_order.hpp"

namespace ygslam {

/// What the stamps of a topic tell, in the order in which its images were recorded.
struct TopicOrder {
  std::vector<bool>
      is_far;  ///< of each image: its stamp is more than kStampJump_ns off the others'
  std::optional<StampOrder::Jump> back;  ///< the first for good
  /// There are different images of the same time: in order of their stamps they would be mixed.
  bool is_mixed = false;
};
[[nodiscard]] TopicOrder order_of(const ImageTopic& topic);

/// Pairs as they were recorded; where the clocks went back, stamps go on from those before.
/// @param colours,depths as BagImages::add() lists the two topics.
/// @return colour images that have no depth image.
std::size_t pair_as_recorded(const ImageTopic& colour, const std::vector<ListedImage>& colours,
                             const ImageTopic& depth, const std::vector<ListedImage>& depths,
                             std::vector<SequencePair>& pairs);

}  // namespace ygslam
