#include "bag/bag_order.hpp"

#include <algorithm>

#include "bag/stream_pairing.hpp"

namespace ygslam {
namespace {

struct Span {
  Timestamp first, last;
};

bool overlap(std::vector<Span> spans) {
  std::ranges::sort(spans, {}, &Span::first);
  for (std::size_t i = 1; i < spans.size(); ++i)
    if (spans[i].first <= spans[i - 1].last) return true;
  return false;
}

}  // namespace

TopicOrder order_of(const ImageTopic& topic) {
  TopicOrder found;
  found.is_far.resize(topic.images.size());
  StampOrder order;
  std::vector<Span> spans;
  const auto take = [&](const StampOrder::Judged& judged) {
    for (const StreamImage& bad : judged.bad)
      found.is_far[bad.number] = order.last() && are_far_apart(bad.stamp, *order.last());
    if (judged.good.empty()) return;
    if (judged.jump && judged.jump->ns < 0 && !found.back) found.back = judged.jump;
    if (spans.empty() || judged.jump) spans.push_back({judged.good.front().stamp, {}});
    spans.back().last = judged.good.back().stamp;
  };
  for (std::size_t i = 0; i < topic.images.size(); ++i)
    take(order.add({topic.images[i].stamp, i, {}}));
  take(order.finish());
  found.is_mixed = found.back && overlap(std::move(spans));
  return found;
}

std::size_t pair_as_recorded(const ImageTopic& colour, const std::vector<ListedImage>& colours,
                             const ImageTopic& depth, const std::vector<ListedImage>& depths,
                             std::vector<SequencePair>& pairs) {
  StreamPairing pairing;
  const auto take = [&] {
    while (const auto pair = pairing.take()) {
      if (!pair->is_whole()) continue;
      const ListedImage& image = colours[pair->colour->number];
      pairs.push_back({pair->colour->stamp, image.decimals, pair->depth->stamp, image.file,
                       depths[pair->depth->number].file});
    }
  };
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < colour.images.size() || j < depth.images.size()) {
    const bool is_colour =
        j == depth.images.size() ||
        (i < colour.images.size() && colour.images[i].order < depth.images[j].order);
    const auto side = is_colour ? StreamPairing::kColour : StreamPairing::kDepth;
    std::size_t& number = is_colour ? i : j;
    const BagImage& image = (is_colour ? colour : depth).images[number];
    static_cast<void>(pairing.add(side, {image.stamp, number, {}}));
    ++number;
    take();
  }
  pairing.finish();
  take();
  return pairing.unpaired();
}

}  // namespace ygslam
