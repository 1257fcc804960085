// One connection to the server of the live page, and what all connections share.
#pragma once

#include <algorithm>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "live/foxglove_protocol.hpp"
#include "live/view_server.hpp"

namespace ygslam {

using ViewMessagePtr = std::shared_ptr<const foxglove::Data>;

/// The newest of each part of a topic.
using ViewParts = std::map<std::uint32_t, ViewMessagePtr>;

/// A request for a page's file, or a client from its handshake to its end. The server's thread
/// alone touches it.
class ViewSession {
 public:
  struct Offer {
    std::size_t topic = 0;
    std::uint32_t part = 0;
    ViewMessagePtr message;
  };
  virtual ~ViewSession() = default;
  virtual void start() = 0;
  /// Its request has come.
  [[nodiscard]] virtual bool has_asked() const = 0;
  /// Messages that go out together where it wants them.
  virtual void offer(std::span<const Offer> offers) = 0;
  /// Closes the connection; what is under way ends with an error.
  virtual void leave() = 0;
};

/// What the sessions share; the server's thread alone touches it, but for what is atomic.
struct ViewHub {
  ViewServerConfig config;
  bool is_loopback = true;
  std::vector<Topic> topics;
  std::vector<std::string> services;
  ViewServer::Callbacks callbacks;
  std::map<std::uint64_t, std::shared_ptr<ViewSession>> sessions;  // in the order they came in
  std::uint64_t arrivals = 0;
  std::vector<std::atomic<int>> wanted;  // subscriptions of each topic
  std::atomic<int> clients{0};
  int onlookers = 0;            // clients without the token, those that shake hands included
  std::vector<ViewParts> last;  // of each topic
  std::string advertisement;

  [[nodiscard]] std::size_t topic_index(std::string_view name) const {
    const auto it = std::ranges::find_if(topics, [&](const Topic& t) { return name == t.name; });
    return static_cast<std::size_t>(it - topics.begin());
  }
};

/// @param number its key in ViewHub::sessions, where it must be put before it starts.
[[nodiscard]] std::shared_ptr<ViewSession> new_view_session(ViewHub& hub, std::uint64_t number,
                                                            boost::asio::ip::tcp::socket socket);

}  // namespace ygslam
