#include "live/view_access.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <random>

namespace ygslam {

std::string new_token() {
  std::random_device device;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", device());
  return token;
}

std::string query_value(std::string_view target, std::string_view key) {
  const std::size_t question = target.find('?');
  std::string_view rest = question == target.npos ? "" : target.substr(question + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    if (pair.substr(0, pair.find('=')) == key && pair.size() > key.size())
      return std::string(pair.substr(key.size() + 1));
  }
  return {};
}

bool is_same_token(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

bool names_this_machine(std::string_view host, std::string_view own_address) {
  const std::size_t bracket = host.starts_with('[') ? host.find(']') : 0;
  const std::string_view name = host.substr(0, host.find(':', bracket));
  return name == "127.0.0.1" || name == "localhost" || name == "[::1]" || name == own_address;
}

}  // namespace ygslam
