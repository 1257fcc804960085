// A server for those who look on: one port, one thread. `/` is a page, `/ws` speaks Foxglove's
// WebSocket protocol (foxglove.websocket.v1), which the page, Foxglove and Lichtblick understand.
// Of a topic, or of each part of one, a client gets the newest message, never a backlog; one that
// stops reading holds up nobody.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "live/run_topics.hpp"

namespace ygslam {

struct ViewServerConfig {
  std::string host = "127.0.0.1";  ///< an IP address of this machine
  std::uint16_t port = 8765;       ///< 0: any that is free
  /// Who knows it may drive; at an address that others reach nobody sees anything without it.
  /// Empty: one is made.
  std::string token{};
  /// Pages of others that may connect, as browsers tell theirs: "https://example.org".
  std::vector<std::string> origins{};
};

/// @param text "", "PORT", "ADDRESS:PORT" or "[ADDRESS]:PORT". @return kUsage for anything else.
[[nodiscard]] Result<ViewServerConfig> parse_view_address(const std::string& text);

class ViewServer {
 public:
  struct Callbacks {
    /// A client that may drive called a service: what became of it, in words.
    std::function<Result<std::string>(std::string_view service)> drive;
    /// Somebody wants a topic that had not been asked for.
    std::function<void()> subscribed;
  };
  struct Message {
    std::string_view topic;
    Timestamp stamp;
    Bytes cdr;
    std::uint32_t part = 0;  ///< see MessageSink::put()
  };
  /// @param services are called with std_srvs/Trigger. The callbacks are called by the server's
  /// thread and must return soon.
  /// @return kUsage if it cannot listen there.
  static Result<std::unique_ptr<ViewServer>> start(const ViewServerConfig& config,
                                                   std::span<const Topic> topics,
                                                   std::span<const char* const> services,
                                                   Callbacks callbacks);
  virtual ~ViewServer() = default;

  // From any thread.
  [[nodiscard]] virtual bool wants(std::string_view topic) const = 0;
  /// What belongs together goes out together.
  virtual void publish(std::vector<Message> messages) = 0;
  [[nodiscard]] virtual int clients() const = 0;

  /// Of the page, with the token.
  [[nodiscard]] virtual std::string url() const = 0;
};

}  // namespace ygslam
