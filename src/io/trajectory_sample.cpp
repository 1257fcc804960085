#include "io/trajectory_sample.hpp"

#include <cctype>
#include <cmath>
#include <map>
#include <string>

#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMostExamined = 2000;  // lines: the first and the last of a long file

std::vector<double> numbers_of(const PoseRecord& record) {
  std::vector<double> values;
  for (const std::string_view field : record.fields)
    values.push_back(parse_number(field).value_or(std::nan("")));
  return values;
}

// Whether a field is a name, and not a number that is missing or not finite.
bool is_text(std::string_view field) {
  std::string word(field.substr(0, std::min<std::size_t>(field.size(), 4)));
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return word.find("nan") == std::string::npos && word.find("inf") == std::string::npos &&
         word.find("null") == std::string::npos && !parse_number(field);
}

}  // namespace

std::size_t usual_columns(const std::vector<PoseRecord>& records) {
  std::map<std::size_t, std::size_t> counts;
  for (const PoseRecord& record : records) ++counts[record.fields.size()];
  const auto most =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
        return std::pair(a.second, a.first) < std::pair(b.second, b.first);
      });
  return most->first;
}

PoseSample sample_of(const std::vector<PoseRecord>& records) {
  PoseSample sample;
  sample.columns = usual_columns(records);
  const std::size_t part = kMostExamined / 2;
  const bool all = records.size() <= kMostExamined;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!all && i >= part && i + part < records.size()) continue;
    if (records[i].fields.size() != sample.columns) continue;
    sample.rows.push_back(numbers_of(records[i]));
    sample.records.push_back(&records[i]);
  }
  return sample;
}

std::vector<std::size_t> columns_of_numbers(const PoseSample& sample) {
  std::vector<std::size_t> columns;
  for (std::size_t c = 0; c < sample.columns; ++c) {
    const bool all_text = std::all_of(sample.records.begin(), sample.records.end(),
                                      [c](const auto* r) { return is_text(r->fields[c]); });
    if (!all_text) columns.push_back(c);
  }
  return columns;
}

PoseSample only_columns(const PoseSample& sample, const std::vector<std::size_t>& columns) {
  PoseSample kept = sample;
  kept.columns = columns.size();
  for (auto& row : kept.rows) {
    std::vector<double> values;
    for (const std::size_t c : columns) values.push_back(row[c]);
    row = std::move(values);
  }
  return kept;
}

}  // namespace ygslam
