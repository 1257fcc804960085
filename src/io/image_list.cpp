#include "io/image_list.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <span>
#include <utility>

#include "io/associated_poses.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

enum class Verdict { kGood, kMalformed, kRefused, kNegative };

// A forward step of more than this is checked against what follows.
constexpr std::int64_t kJump_ns = 10'000'000'000;
constexpr std::size_t kLookAhead = 100;    // lines
constexpr std::size_t kFewAtStart = 9;     // as many lines must follow for each that jumped
constexpr std::size_t kOrderedLines = 10;  // of as many one may go back in a list in order

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

// A folder or file whose name begins so.
bool names_depth(std::string_view path) {
  return path.starts_with("depth") || path.find("/depth") != std::string_view::npos;
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
  const auto halves = split_pair(split_association(line).images);
  if (!halves) return Verdict::kMalformed;
  const Verdict first = parse_line(halves->first, pair.colour);
  const Verdict second = parse_line(halves->second, pair.depth);
  if (first != Verdict::kGood || second != Verdict::kGood) return std::max(first, second);
  if (names_depth(pair.colour.file) && !names_depth(pair.depth.file))
    std::swap(pair.colour, pair.depth);
  return Verdict::kGood;
}

template <typename Entry>
Timestamp stamp_of(const Entry& entry) {
  return key_image(entry).stamp;
}

// Does the list go back after this line, and on from where it was? Then this one jumped ahead, not
// they back.
template <typename Entry>
bool jumps_ahead(const std::vector<Entry>& entries, std::size_t i,
                 std::optional<Timestamp> newest) {
  const Timestamp stamp = stamp_of(entries[i]);
  if (newest && stamp.ns - newest->ns <= kJump_ns) return false;
  std::size_t before = 0;
  std::size_t beyond = 0;
  for (std::size_t j = i + 1; j < std::min(entries.size(), i + 1 + kLookAhead); ++j) {
    const Timestamp later = stamp_of(entries[j]);
    if (later > stamp) ++beyond;
    const bool goes_on = newest ? later > *newest && later.ns - newest->ns <= kJump_ns
                                : stamp.ns - later.ns > kJump_ns;
    if (goes_on && later < stamp) ++before;
  }
  // The first lines may also be the second half of a list: only a few jumped.
  return newest ? before > beyond : before > kFewAtStart * (beyond + 1);
}

// Does the list go on after this line from where it was? Then this one jumped back.
template <typename Entry>
bool jumps_back(const std::vector<Entry>& entries, std::size_t i, std::optional<Timestamp> newest) {
  const Timestamp stamp = stamp_of(entries[i]);
  if (!newest || newest->ns - stamp.ns <= kJump_ns) return false;
  std::size_t with_it = 0;
  std::size_t beyond = 0;
  for (std::size_t j = i + 1; j < std::min(entries.size(), i + 1 + kLookAhead); ++j) {
    const Timestamp later = stamp_of(entries[j]);
    (later > *newest ? beyond : with_it) += 1;
  }
  return beyond > kFewAtStart * (with_it + 1);
}

// Lines that jumped are known as such only where the others are in order.
template <typename Entry>
void leave_out_jumps(ParsedList<Entry>& list) {
  std::size_t descents = 0;
  for (std::size_t i = 1; i < list.entries.size(); ++i)
    descents += stamp_of(list.entries[i]) < stamp_of(list.entries[i - 1]) ? 1 : 0;
  if (descents == 0 || descents > list.entries.size() / kOrderedLines) return;
  std::vector<Entry> kept;
  kept.reserve(list.entries.size());
  std::optional<Timestamp> newest;
  for (std::size_t i = 0; i < list.entries.size(); ++i) {
    if (jumps_ahead(list.entries, i, newest) || jumps_back(list.entries, i, newest)) {
      ++list.counts.jumped;
      continue;
    }
    newest = std::max(newest.value_or(Timestamp{0}), stamp_of(list.entries[i]));
    kept.push_back(std::move(list.entries[i]));
  }
  list.entries = std::move(kept);
}

void shift(ListedImage& image, std::int64_t ns) { image.stamp.ns += ns; }
void shift(ListedPair& pair, std::int64_t ns) {
  shift(pair.colour, ns);
  shift(pair.depth, ns);
}

// The entries from the reset on, up to the next.
template <typename Entry>
std::span<Entry> after_reset(ParsedList<Entry>& list, std::size_t k) {
  const std::size_t begin = list.resets[k].place;
  const std::size_t end =
      k + 1 < list.resets.size() ? list.resets[k + 1].place : list.entries.size();
  return std::span(list.entries).subspan(begin, end - begin);
}

template <typename Entry>
void leave_out_doubles(ParsedList<Entry>& list) {
  std::vector<Entry> kept;
  kept.reserve(list.entries.size());
  std::size_t k = 0;
  for (std::size_t i = 0; i < list.entries.size(); ++i) {
    if (k < list.resets.size() && list.resets[k].place == i) list.resets[k++].place = kept.size();
    if (kept.empty() || stamp_of(kept.back()) != stamp_of(list.entries[i]))
      kept.push_back(std::move(list.entries[i]));
  }
  list.counts.doubled += list.entries.size() - kept.size();
  list.entries = std::move(kept);
}

// Lines in any order; of several with one stamp the first.
template <typename Entry>
void put_in_order(ParsedList<Entry>& list) {
  leave_out_jumps(list);
  std::vector<Timestamp> stamps;
  for (const Entry& entry : list.entries) stamps.push_back(stamp_of(entry));
  list.resets = clock_resets(stamps);
  for (std::size_t k = 0; k < list.resets.size(); ++k)
    for (Entry& entry : after_reset(list, k)) shift(entry, list.resets[k].shift_ns);
  Timestamp newest{0};
  for (const Entry& entry : list.entries) {
    list.counts.moved += stamp_of(entry) < newest ? 1 : 0;
    newest = std::max(newest, stamp_of(entry));
  }
  std::ranges::stable_sort(list.entries, {}, stamp_of<Entry>);
  leave_out_doubles(list);
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
  put_in_order(list);
  return list;
}

}  // namespace

ListCounts& ListCounts::operator+=(const ListCounts& other) {
  lines += other.lines;
  malformed += other.malformed;
  refused += other.refused;
  negative += other.negative;
  doubled += other.doubled;
  jumped += other.jumped;
  moved += other.moved;
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
  add(doubled, " with the stamp of another line");
  add(jumped, " with a stamp far from the others");
  text.pop_back();
  return text;
}

ParsedList<ListedImage> parse_image_list(std::string_view text) {
  return parse_list<ListedImage>(text);
}

ParsedList<ListedPair> parse_associations(std::string_view text) {
  return parse_list<ListedPair>(text);
}

bool align_resets(ParsedList<ListedImage>& colour, ParsedList<ListedImage>& depth) {
  if (colour.resets.size() != depth.resets.size()) return false;
  for (std::size_t k = 0; k < colour.resets.size(); ++k) {
    // The larger of both: neither goes back.
    const std::int64_t shift_ns = std::max(colour.resets[k].shift_ns, depth.resets[k].shift_ns);
    for (auto* list : {&colour, &depth}) {
      ClockReset& reset = list->resets[k];
      const std::int64_t more_ns = shift_ns - std::exchange(reset.shift_ns, shift_ns);
      for (ListedImage& image : after_reset(*list, k)) shift(image, more_ns);
    }
  }
  return true;
}

std::vector<ListedImage> in_time_order(std::vector<ListedImage> images, ListCounts& counts) {
  std::ranges::stable_sort(images, {}, &ListedImage::stamp);
  const auto doubles = std::ranges::unique(images, {}, &ListedImage::stamp);
  counts.doubled += doubles.size();
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
