#include "io/image_list.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "io/text.hpp"

namespace ygslam {
namespace {

enum class Verdict { kGood, kMalformed, kRefused, kNegative };

// A forward step of more than this is checked against what follows.
constexpr std::int64_t kJump_ns = 10'000'000'000;
constexpr std::size_t kLookAhead = 100;  // lines

const ListedImage& key_image(const ListedImage& image) { return image; }
const ListedImage& key_image(const ListedPair& pair) { return pair.colour; }

Verdict parse_image(std::string_view stamp_word, std::string_view path, ListedImage& image) {
  const auto stamp = parse_stamp(stamp_word);
  path = trimmed(path);
  if (!stamp || path.empty()) return Verdict::kMalformed;
  if (!is_inside(path)) return Verdict::kRefused;
  if (stamp->stamp.ns < 0) return Verdict::kNegative;
  image = {stamp->stamp, stamp->decimals, std::string(path)};
  return Verdict::kGood;
}

Verdict parse_line(std::string_view line, ListedImage& image) {
  const std::size_t space = line.find_first_of(" \t");
  if (space == std::string_view::npos) return Verdict::kMalformed;
  return parse_image(line.substr(0, space), line.substr(space), image);
}

// Where the first path ends: at the first later word that is a stamp and has a path behind it.
std::optional<std::pair<std::string_view, std::string_view>> split_pair(std::string_view line) {
  const auto words = words_of(line);
  for (std::size_t i = 2; i + 1 < words.size(); ++i) {
    if (!parse_stamp(words[i])) continue;
    const auto position = static_cast<std::size_t>(words[i].data() - line.data());
    return std::pair{trimmed(line.substr(0, position)), line.substr(position)};
  }
  return std::nullopt;
}

Verdict parse_line(std::string_view line, ListedPair& pair) {
  const auto halves = split_pair(line);
  if (!halves) return Verdict::kMalformed;
  const Verdict first = parse_line(halves->first, pair.colour);
  const Verdict second = parse_line(halves->second, pair.depth);
  if (first != Verdict::kGood || second != Verdict::kGood) return std::max(first, second);
  if (pair.colour.file.starts_with("depth/") && pair.depth.file.starts_with("rgb/")) {
    std::swap(pair.colour, pair.depth);
  }
  return Verdict::kGood;
}

// Do most of the following stamps lie between the newest accepted one and this one? Then this one
// jumped ahead, not they back.
template <typename Entry>
bool jumps_ahead(const std::vector<Entry>& entries, std::size_t i, Timestamp newest) {
  const Timestamp stamp = key_image(entries[i]).stamp;
  if (stamp.ns - newest.ns <= kJump_ns) return false;
  std::size_t between = 0;
  std::size_t beyond = 0;
  for (std::size_t j = i + 1; j < std::min(entries.size(), i + 1 + kLookAhead); ++j) {
    const Timestamp later = key_image(entries[j]).stamp;
    if (later > stamp) ++beyond;
    if (later > newest && later < stamp) ++between;
  }
  return between > beyond;
}

// Policy for bad stamps: what is not newer than the newest accepted entry is dropped.
template <typename Entry>
void keep_ordered(ParsedList<Entry>& list) {
  std::vector<Entry> kept;
  kept.reserve(list.entries.size());
  for (std::size_t i = 0; i < list.entries.size(); ++i) {
    const Timestamp stamp = key_image(list.entries[i]).stamp;
    // Before the first one nothing is accepted: one frame ahead of the next is no jump.
    const bool starts = kept.empty();
    if (!starts && stamp <= key_image(kept.back()).stamp) {
      ++list.counts.out_of_order;
    } else if (jumps_ahead(list.entries, i,
                           starts ? Timestamp{-1} : key_image(kept.back()).stamp)) {
      ++list.counts.jumped;
    } else {
      kept.push_back(std::move(list.entries[i]));
    }
  }
  list.entries = std::move(kept);
}

template <typename Entry>
ParsedList<Entry> parse_list(std::string_view text) {
  ParsedList<Entry> list;
  for (const TextLine& line : data_lines(text)) {
    ++list.counts.lines;
    Entry entry;
    const Verdict verdict = parse_line(line.text, entry);
    if (verdict == Verdict::kGood) {
      list.entries.push_back(std::move(entry));
      continue;
    }
    list.counts.malformed += verdict == Verdict::kMalformed ? 1 : 0;
    list.counts.refused += verdict == Verdict::kRefused ? 1 : 0;
    list.counts.negative += verdict == Verdict::kNegative ? 1 : 0;
    if (list.first_fault.empty()) {
      list.first_fault = std::to_string(line.number) + ": '" + printable(line.text) + "'";
    }
  }
  keep_ordered(list);
  return list;
}

}  // namespace

ListCounts& ListCounts::operator+=(const ListCounts& other) {
  lines += other.lines;
  malformed += other.malformed;
  refused += other.refused;
  negative += other.negative;
  out_of_order += other.out_of_order;
  jumped += other.jumped;
  return *this;
}

std::string ListCounts::summary() const {
  if (left_out() == 0) return {};
  std::string text =
      std::to_string(left_out()) + " of " + std::to_string(lines) + " lines left out:";
  const auto add = [&](std::size_t count, const char* what) {
    if (count > 0) text.append(1, ' ').append(std::to_string(count)).append(what).append(1, ',');
  };
  add(malformed, " malformed");
  add(refused, " with a path outside the folder");
  add(negative, " with a negative stamp");
  add(out_of_order, " not newer than the one before");
  add(jumped, " with a stamp far ahead");
  text.pop_back();
  return text;
}

ParsedList<ListedImage> parse_image_list(std::string_view text) {
  return parse_list<ListedImage>(text);
}

ParsedList<ListedPair> parse_associations(std::string_view text) {
  return parse_list<ListedPair>(text);
}

std::vector<ListedImage> in_time_order(std::vector<ListedImage> images, ListCounts& counts) {
  std::ranges::stable_sort(images, {}, &ListedImage::stamp);
  const auto doubles = std::ranges::unique(images, {}, &ListedImage::stamp);
  counts.out_of_order += doubles.size();
  images.erase(doubles.begin(), doubles.end());
  return images;
}

bool is_inside(std::string_view relative_path) {
  if (relative_path.find('\0') != std::string_view::npos) return false;
  const std::filesystem::path path(relative_path);
  return !path.empty() && path.is_relative() &&
         std::none_of(path.begin(), path.end(), [](const auto& part) { return part == ".."; });
}

}  // namespace ygslam
