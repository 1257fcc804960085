#include <algorithm>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "io/image_list.hpp"
#include "io/pairing.hpp"

namespace ygslam::fuzz {
namespace {

void check(const ListedImage& image) {
  CHECK(is_inside(image.file));
  CHECK(image.stamp.ns >= 0 && image.decimals >= 0 && image.decimals <= 9);
}

}  // namespace

void lists(std::string_view bytes) {
  const auto images = parse_image_list(bytes);
  std::vector<Timestamp> stamps;
  for (const ListedImage& image : images.entries) {
    check(image);
    CHECK(stamps.empty() || stamps.back() < image.stamp);
    stamps.push_back(image.stamp);
  }
  const auto pairs = parse_associations(bytes);
  std::vector<Timestamp> pair_stamps;
  for (const ListedPair& pair : pairs.entries) {
    check(pair.colour);
    check(pair.depth);
    CHECK(pair_stamps.empty() || pair_stamps.back() < pair.colour.stamp);
    pair_stamps.push_back(pair.colour.stamp);
  }
  const auto matched = pair_one_to_one(stamps, pair_stamps, kMaxPairDifference_ns);
  CHECK(matched.size() <= std::min(stamps.size(), pair_stamps.size()));
  (void)estimate_offset_ns(stamps, pair_stamps);
}

}  // namespace ygslam::fuzz
