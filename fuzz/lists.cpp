#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "io/image_list.hpp"
#include "io/name_times.hpp"
#include "io/pairing.hpp"

namespace ygslam::fuzz {
namespace {

void check(const ListedImage& image) {
  CHECK(is_inside(image.file));
  CHECK(image.stamp.ns >= 0 && image.decimals >= 0 && image.decimals <= 9);
}

/// Lines as names of images: what is taken has one time for each, none below zero.
void name_times(std::string_view bytes) {
  std::set<std::string> names;
  for (std::size_t end = 0; !bytes.empty() && names.size() < 200; bytes.remove_prefix(end)) {
    end = std::min(bytes.find('\n'), bytes.size());
    names.emplace(bytes.substr(0, end));
    end = std::min(end + 1, bytes.size());
  }
  const std::vector<std::string> stems(names.begin(), names.end());
  const auto times = times_of_names(stems);
  if (!times.ok()) return;
  CHECK(times->stamps.size() == stems.size() && times->decimals >= 0 && times->decimals <= 9);
  std::set<std::int64_t> seen;
  for (const auto& stamp : times->stamps)
    if (stamp) CHECK(stamp->ns >= 0 && seen.insert(stamp->ns).second);
}

}  // namespace

void lists(std::string_view bytes) {
  name_times(bytes);
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
