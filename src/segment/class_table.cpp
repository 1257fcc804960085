#include "segment/class_table.hpp"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "scene/coco.hpp"

namespace ygslam {
namespace {

constexpr int kMaxClasses = 10000;
constexpr int kAnnotationNumbers = 91;

int coco_class_of(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  const auto& names = coco_class_names();
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? kNoCocoClass : static_cast<int>(found - names.begin());
}

/// A number at the start of `text`, which is taken off it.
std::optional<int> take_number(std::string_view& text) {
  int value = 0;
  const auto [end, ec] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (ec != std::errc{} || value < 0 || value >= kMaxClasses) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

/// A string in either kind of quotes at the start of `text`, which is taken off it.
std::optional<std::string> take_string(std::string_view& text) {
  if (text.empty() || (text[0] != '\'' && text[0] != '"')) return std::nullopt;
  std::string value;
  for (std::size_t i = 1; i < text.size(); ++i) {
    if (text[i] == text[0]) {
      text.remove_prefix(i + 1);
      return value;
    }
    if (text[i] == '\\' && i + 1 < text.size()) ++i;
    value += text[i];
  }
  return std::nullopt;
}

/// Takes `word` and the blanks around it off the start of `text`. @return false if it is not there.
bool take(std::string_view& text, char word) {
  const auto skip_blanks = [&] {
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  };
  skip_blanks();
  if (text.empty() || text[0] != word) return false;
  text.remove_prefix(1);
  skip_blanks();
  return true;
}

/// Ultralytics names the classes of a network that was not trained by their numbers.
bool says_nothing(const ClassNames& names) {
  return std::all_of(names.begin(), names.end(),
                     [](const auto& entry) { return entry.second == std::to_string(entry.first); });
}

}  // namespace

ClassTable coco_table() {
  ClassTable table(kCocoClasses);
  std::iota(table.begin(), table.end(), 0);
  return table;
}

ClassTable coco_annotation_table() {
  // https://cocodataset.org/#format-data, "categories" of instances_val2017.json.
  constexpr std::array kLeftOut{0, 12, 26, 29, 30, 45, 66, 68, 69, 71, 83};
  ClassTable table(kAnnotationNumbers, kNoCocoClass);
  int next = 0;
  for (int number = 0; number < kAnnotationNumbers; ++number) {
    if (!std::binary_search(kLeftOut.begin(), kLeftOut.end(), number)) table[number] = next++;
  }
  return table;
}

ClassNames parse_python_names(std::string_view text) {
  ClassNames names;
  if (!take(text, '{')) return names;
  do {
    const auto number = take_number(text);
    if (!number || !take(text, ':')) break;
    auto name = take_string(text);
    if (!name) break;
    names.emplace(*number, std::move(*name));
  } while (take(text, ','));
  return names;
}

ClassNames parse_rfdetr_names(std::string_view text) {
  ClassNames names;
  const auto json = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("class_id_to_name")) return names;
  const auto& table = json["class_id_to_name"];
  if (!table.is_object()) return names;
  for (const auto& [key, value] : table.items()) {
    std::string_view rest(key);
    const auto number = take_number(rest);
    if (number && rest.empty() && value.is_string())
      names.emplace(*number, value.get<std::string>());
  }
  return names;
}

Result<ClassTable> make_class_table(int classes, const ClassNames& given) {
  const ClassNames names = says_nothing(given) ? ClassNames{} : given;
  if (names.empty() && (classes == 0 || classes == kCocoClasses)) return coco_table();
  if (names.empty() && classes == kAnnotationNumbers) return coco_annotation_table();
  if (names.empty()) {
    return Error{ErrorKind::kModel, std::to_string(classes) +
                                        " classes without names in the file, COCO has 80 (or 91 "
                                        "numbers)"};
  }
  ClassTable table(classes > 0 ? classes : names.rbegin()->first + 1, kNoCocoClass);
  for (const auto& [number, name] : names) {
    if (number < std::ssize(table)) table[number] = coco_class_of(name);
  }
  if (std::all_of(table.begin(), table.end(), [](int c) { return c == kNoCocoClass; })) {
    return Error{ErrorKind::kModel, "none of its " + std::to_string(table.size()) +
                                        " classes is one of COCO's 80 (person, dog, ...)"};
  }
  return table;
}

}  // namespace ygslam
