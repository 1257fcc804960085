#include "io/json_text.hpp"

#include <algorithm>

#include "io/text.hpp"

namespace ygslam {
namespace {

// Greatest nesting outside of strings.
int depth_of(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      in_string = c != '"';
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      deepest = std::max(deepest, ++depth);
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return deepest;
}

}  // namespace

Result<nlohmann::json> parse_json(std::string_view text, const std::string& name) {
  const auto fault = [&](const std::string& what) {
    return Error{ErrorKind::kInput, name + ": " + what};
  };
  if (depth_of(text) > kMaxJsonDepth) {
    return fault("JSON nested deeper than " + std::to_string(kMaxJsonDepth));
  }
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    return fault("not JSON (byte " + std::to_string(error.byte) + ")");
  } catch (const nlohmann::json::exception&) {  // a number that fits no type
    return fault("not JSON (a number out of range)");
  }
}

Result<nlohmann::json> read_json(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text.ok()) return text.error();
  return parse_json(*text, path.string());
}

}  // namespace ygslam
