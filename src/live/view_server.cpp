#include "live/view_server.hpp"

#include <boost/asio.hpp>
#include <chrono>
#include <optional>

#include "core/check.hpp"
#include "core/log.hpp"
#include "core/worker_thread.hpp"
#include "live/view_access.hpp"
#include "live/view_session.hpp"

namespace ygslam {
namespace {

namespace asio = boost::asio;
using tcp = asio::ip::tcp;
using BoostError = boost::system::error_code;

constexpr std::size_t kMostClients = 64;
constexpr auto kRetry = std::chrono::milliseconds(100);

class BeastViewServer : public ViewServer {
 public:
  BeastViewServer(const ViewServerConfig& config, std::span<const Topic> topics,
                  std::span<const char* const> services, Callbacks callbacks)
      : acceptor_(io_) {
    hub_.config = config;
    if (hub_.config.token.empty()) hub_.config.token = new_token();
    hub_.topics.assign(topics.begin(), topics.end());
    hub_.services.assign(services.begin(), services.end());
    hub_.callbacks = std::move(callbacks);
    hub_.wanted = std::vector<std::atomic<int>>(topics.size());
    hub_.last.resize(topics.size());
    hub_.advertisement = foxglove::advertise(topics);
  }
  ~BeastViewServer() override { io_.stop(); }

  Status listen() {
    BoostError error;
    const auto address = asio::ip::make_address(hub_.config.host, error);
    hub_.is_loopback = !error && address.is_loopback();
    const tcp::endpoint endpoint(address, hub_.config.port);
    if (!error) acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (error)
      return Error{ErrorKind::kUsage, fmt::format("--view {}:{}: {}", hub_.config.host,
                                                  hub_.config.port, error.message())};
    hub_.config.port = acceptor_.local_endpoint().port();
    accept_next();
    thread_.emplace([this](const std::stop_token&) { serve(); });
    return Ok{};
  }

  [[nodiscard]] bool wants(std::string_view topic) const override {
    const std::size_t index = hub_.topic_index(topic);
    return index < hub_.wanted.size() && hub_.wanted[index] > 0;
  }
  void publish(std::vector<Message> messages) override {
    std::vector<ViewSession::Offer> offers;
    for (Message& message : messages) {
      const std::size_t index = hub_.topic_index(message.topic);
      CHECK(index < hub_.topics.size(), "a topic that was advertised");
      offers.push_back({index, message.part,
                        std::make_shared<const foxglove::Data>(
                            foxglove::Data{message.stamp, std::move(message.cdr)})});
    }
    asio::post(io_, [this, offers = std::move(offers)] {
      for (const ViewSession::Offer& offer : offers)
        hub_.last[offer.topic][offer.part] = offer.message;
      const auto sessions = hub_.sessions;  // a session may leave meanwhile
      for (const auto& [number, session] : sessions) session->offer(offers);
    });
  }
  [[nodiscard]] int clients() const override { return hub_.clients; }
  [[nodiscard]] std::string url() const override {
    const bool is_any = hub_.config.host == "0.0.0.0" || hub_.config.host == "::";
    BoostError error;
    const std::string name = is_any ? asio::ip::host_name(error) : "";
    const std::string host = name.empty() ? hub_.config.host : name;
    return fmt::format("http://{}:{}/#{}", host.find(':') == host.npos ? host : "[" + host + "]",
                       hub_.config.port, hub_.config.token);
  }

 private:
  /// What one client's message comes to must not end the others' service.
  void serve() {
    for (;;) {
      try {
        io_.run();
        return;
      } catch (const std::exception& e) {
        log::warn("the live page: {}", e.what());
      }
    }
  }

  /// Ends the connection that has been silent longest. An honest one asks as soon as it is there,
  /// so that whoever opens connections without end does not keep it out.
  void make_room() {
    const auto it = std::ranges::find_if(
        hub_.sessions, [](const auto& entry) { return !entry.second->has_asked(); });
    if (it == hub_.sessions.end()) return;
    const std::shared_ptr<ViewSession> silent = it->second;
    silent->leave();
  }

  void accept_next() {
    acceptor_.async_accept([this](BoostError error, tcp::socket socket) {
      if (error) {  // no files are left, say: it may pass
        retry_.expires_after(kRetry);
        return retry_.async_wait([this](BoostError stopped) {
          if (!stopped && acceptor_.is_open()) accept_next();
        });
      }
      if (hub_.sessions.size() >= kMostClients) make_room();
      if (hub_.sessions.size() < kMostClients) {
        socket.set_option(tcp::no_delay(true), error);
        const std::uint64_t number = hub_.arrivals++;
        const auto session = new_view_session(hub_, number, std::move(socket));
        hub_.sessions.emplace(number, session);
        session->start();
      }
      if (acceptor_.is_open()) accept_next();
    });
  }

  asio::io_context io_{1};
  ViewHub hub_;
  tcp::acceptor acceptor_;
  asio::steady_timer retry_{io_};
  std::optional<WorkerThread> thread_;  // last: it uses everything above
};

}  // namespace

Result<std::unique_ptr<ViewServer>> ViewServer::start(const ViewServerConfig& config,
                                                      std::span<const Topic> topics,
                                                      std::span<const char* const> services,
                                                      Callbacks callbacks) {
  auto server = std::make_unique<BeastViewServer>(config, topics, services, std::move(callbacks));
  if (Status listening = server->listen(); !listening.ok()) return listening.error();
  return std::unique_ptr<ViewServer>(std::move(server));
}

}  // namespace ygslam
