#include <boost/asio/ip/address.hpp>
#include <charconv>

#include "live/view_server.hpp"

namespace ygslam {

Result<ViewServerConfig> parse_view_address(const std::string& text) {
  ViewServerConfig config;
  const Error fault{ErrorKind::kUsage, "--view " + text + ": PORT or ADDRESS:PORT is meant"};
  if (text.empty()) return config;
  const std::size_t colon = text.rfind(':');
  std::string port = text;
  if (colon != text.npos) {
    config.host = text.substr(0, colon);
    port = text.substr(colon + 1);
    if (config.host.starts_with('[') && config.host.ends_with(']'))
      config.host = config.host.substr(1, config.host.size() - 2);
  }
  boost::system::error_code error;
  static_cast<void>(boost::asio::ip::make_address(config.host, error));
  const auto [end, code] = std::from_chars(port.data(), port.data() + port.size(), config.port);
  if (error || code != std::errc() || end != port.data() + port.size()) return fault;
  return config;
}

}  // namespace ygslam
