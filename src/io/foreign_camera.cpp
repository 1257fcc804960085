#include "io/foreign_camera.hpp"

#include <algorithm>
#include <array>

#include "io/image_file.hpp"
#include "io/text.hpp"

namespace ygslam::foreign_camera {
namespace {

/// Whether a line is indented. @param line a view into `text`.
bool is_indented(std::string_view text, std::string_view line) {
  const auto at = static_cast<std::size_t>(line.data() - text.data());
  return at > 0 && (text[at - 1] == ' ' || text[at - 1] == '\t');
}

/// What stands behind a key, up to the next one that is not below it.
std::string_view section_behind(std::string_view text, std::size_t at) {
  for (std::size_t end = text.find('\n', at); end != std::string_view::npos;
       end = text.find('\n', end + 1)) {
    const std::string_view next = text.substr(end + 1);
    const bool is_below =
        next.empty() || std::string_view(" \t\r\n#").find(next.front()) != std::string_view::npos;
    const bool is_entry = next.starts_with('-') && !next.starts_with("---");
    if (!is_below && !is_entry) return text.substr(at, end - at);
  }
  return text.substr(at);
}

/// Numbers in brackets, or one a line behind dashes. @return nothing where one is no number.
std::optional<std::vector<double>> listed_numbers(std::string_view section) {
  std::string entries;
  const std::size_t begin = section.find('[');
  const std::size_t end = section.find(']');
  if (begin != std::string_view::npos && end != std::string_view::npos && end > begin) {
    entries = section.substr(begin + 1, end - begin - 1);
  } else {
    for (const TextLine& line : data_lines(section))
      if (line.text.starts_with("- ")) entries.append(line.text.substr(1)) += ' ';
  }
  std::vector<double> numbers;
  for (const std::string_view word : words_of(entries, ",\r\n")) {
    const auto number = parse_number(word);
    if (!number) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

}  // namespace

Error fault(const std::string& name, const std::string& what) {
  return {ErrorKind::kConfig, name + ": " + what};
}

ForeignCamera blank(const std::string& taken_for) {
  ForeignCamera foreign;
  foreign.taken_for = taken_for;
  foreign.camera.width = foreign.camera.height = 0;
  foreign.camera.depth_scale = 0;
  return foreign;
}

bool set_side(double value, int& side_px) {
  if (!(value >= 1 && value <= kMaxImageSide_px) || value != static_cast<int>(value)) return false;
  side_px = static_cast<int>(value);
  return true;
}

void set_lens(CameraConfig& camera, double fx, double fy, double cx, double cy) {
  camera.fx = fx, camera.fy = fy, camera.cx = cx, camera.cy = cy;
}

void set_distortion(CameraConfig& camera, const std::vector<double>& values) {
  const std::array<double*, 5> places = {&camera.k1, &camera.k2, &camera.p1, &camera.p2,
                                         &camera.k3};
  for (std::size_t i = 0; i < std::min(values.size(), places.size()); ++i) *places[i] = values[i];
}

std::string FlatYaml::value(std::string_view key) const {
  const auto found = values.find(key);
  return found == values.end() ? std::string() : found->second;
}

bool FlatYaml::is_not_0(std::string_view key) const {
  return parse_number(value(key)).value_or(0) != 0;
}

std::optional<std::vector<double>> FlatYaml::numbers(std::string_view key) const {
  const std::string list = value(key);
  return list.starts_with('[') ? listed_numbers(list) : std::nullopt;
}

FlatYaml flat_yaml(std::string_view text) {
  FlatYaml yaml;
  std::string group;
  for (const TextLine& line : data_lines(text)) {
    const std::size_t colon = line.text.find(':');
    if (line.text.front() == '%' || colon == std::string_view::npos) continue;
    std::string_view value = line.text.substr(colon + 1);
    value = trimmed(value.substr(0, value.find('#')));
    if (value.size() >= 2 && (value.front() == '"' || value.front() == '\''))
      value = value.substr(1, value.size() - 2);
    std::string key(trimmed(line.text.substr(0, colon)));
    if (!is_indented(text, line.text)) {
      group = value.empty() ? key : std::string();
    } else if (!group.empty()) {
      key = group + "." + key;
    }
    const auto [known, is_new] = yaml.values.emplace(key, value);
    if (!is_new && known->second != value) yaml.contradicted.insert(std::move(key));
  }
  return yaml;
}

std::optional<std::vector<double>> numbers_behind(std::string_view text, std::string_view key) {
  std::optional<std::vector<double>> numbers;
  for (std::size_t at = text.find(key); at != std::string_view::npos; at = text.find(key, at + 1)) {
    const bool starts = at == 0 || text[at - 1] == '\n';
    if (!starts || !trimmed(text.substr(at + key.size(), 2)).starts_with(':')) continue;
    auto found = listed_numbers(section_behind(text, at + key.size()));
    if (!found) return {};
    if (numbers && *numbers != *found) return std::vector<double>();
    numbers = std::move(found);
  }
  return numbers;
}

}  // namespace ygslam::foreign_camera
