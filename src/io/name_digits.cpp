#include "io/name_digits.hpp"

#include <algorithm>
#include <charconv>
#include <map>

namespace ygslam::name_digits {

SplitName split(std::string_view stem) {
  constexpr std::string_view kDigits = "0123456789";
  SplitName name;
  while (!stem.empty()) {
    const std::size_t begin = std::min(stem.find_first_of(kDigits), stem.size());
    name.form += stem.substr(0, begin);
    const auto added = name.form.end() - static_cast<std::ptrdiff_t>(begin);
    std::replace(added, name.form.end(), '\1', '\2');  // a name may hold what marks a group
    stem.remove_prefix(begin);
    if (stem.empty()) break;
    const std::size_t end = std::min(stem.find_first_not_of(kDigits), stem.size());
    name.form += '\1';
    name.groups.push_back(stem.substr(0, end));
    stem.remove_prefix(end);
  }
  return name;
}

std::string usual_form(const std::vector<SplitName>& names) {
  std::map<std::string, std::size_t> counts;
  for (const SplitName& name : names)
    if (!name.groups.empty()) ++counts[name.form];
  const auto most =
      std::ranges::max_element(counts, {}, &std::map<std::string, std::size_t>::value_type::second);
  return most == counts.end() ? std::string() : most->first;
}

std::vector<std::string> signs_of(const std::string& form) {
  std::vector<std::string> signs;
  for (std::size_t at = form.find('\1'); at != std::string::npos;) {
    const std::size_t next = form.find('\1', at + 1);
    if (next == std::string::npos) break;
    signs.push_back(form.substr(at + 1, next - at - 1));
    at = next;
  }
  return signs;
}

Column column_of(const std::vector<SplitName>& names, std::size_t group) {
  Column column;
  for (const SplitName& name : names) {
    const std::string_view digits = name.groups[group];
    column.digits.push_back(digits);
    column.varies |= digits != column.digits.front();
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc{} && end == digits.data() + digits.size())
      column.values.push_back(value);
  }
  if (column.values.size() < names.size()) column.values.clear();
  const auto [low, high] = std::ranges::minmax(column.digits, {}, &std::string_view::size);
  column.shortest = low.size();
  column.longest = high.size();
  return column;
}

}  // namespace ygslam::name_digits
