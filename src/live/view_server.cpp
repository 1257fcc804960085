#include "live/view_server.hpp"

#include <array>
#include <atomic>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <map>
#include <optional>

#include "core/log.hpp"
#include "core/worker_thread.hpp"
#include "live/foxglove_protocol.hpp"
#include "live/page_file.hpp"
#include "live/view_access.hpp"

namespace ygslam {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using BoostError = boost::system::error_code;

constexpr std::size_t kMostClients = 64;
constexpr int kMostOnlookers = 56;              // of them, so that who has the token finds a place
constexpr std::size_t kMostSubscriptions = 32;  // of a client
constexpr std::size_t kMostWaiting = 256;       // texts to a client that does not read them
constexpr std::size_t kLongestMessage = 1 << 16;
constexpr std::uint32_t kLongestHead = 1 << 13;
constexpr auto kHandshake = std::chrono::seconds(5);
constexpr auto kRetry = std::chrono::milliseconds(100);

using Request = http::request<http::empty_body>;
using MessagePtr = std::shared_ptr<const foxglove::Data>;

std::string text_of(beast::string_view view) { return {view.data(), view.size()}; }

const char* media_type(std::string_view name) {
  if (name.ends_with(".html")) return "text/html; charset=utf-8";
  if (name.ends_with(".js")) return "text/javascript; charset=utf-8";
  if (name.ends_with(".css")) return "text/css; charset=utf-8";
  return "application/octet-stream";
}

class Session;

/// What the sessions share; the server's thread alone touches it, but for what is atomic.
struct Hub {
  ViewServerConfig config;
  bool is_loopback = true;
  std::vector<Topic> topics;
  std::vector<std::string> services;
  ViewServer::Callbacks callbacks;
  std::map<std::uint64_t, std::shared_ptr<Session>> sessions;  // in the order they came in
  std::uint64_t arrivals = 0;
  std::vector<std::atomic<int>> wanted;  // subscriptions of each topic
  std::atomic<int> clients{0};
  int onlookers = 0;             // clients without the token, those that shake hands included
  std::vector<MessagePtr> last;  // of each topic
  std::string advertisement;

  [[nodiscard]] std::size_t topic_index(std::string_view name) const {
    const auto it = std::ranges::find_if(topics, [&](const Topic& t) { return name == t.name; });
    return static_cast<std::size_t>(it - topics.begin());
  }
};

/// One connection: a request for a page's file, or a client from its handshake to its end.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(Hub& hub, std::uint64_t number, tcp::socket socket)
      : hub_(hub), number_(number), stream_(std::move(socket)) {
    parser_.header_limit(kLongestHead);
    parser_.body_limit(0);
  }

  void start() {
    stream_.expires_after(kHandshake);
    http::async_read(stream_, buffer_, parser_,
                     [self = shared_from_this()](BoostError error, std::size_t) {
                       if (error || self->has_left_) return self->leave();
                       self->has_asked_ = true;
                       self->answer(self->parser_.get());
                     });
  }

  /// Its request has come.
  [[nodiscard]] bool has_asked() const { return has_asked_; }

  void offer(std::size_t topic, const MessagePtr& message) {
    for (const auto& [subscription, its_topic] : subscriptions_)
      if (its_topic == topic) pending_[subscription] = message;
    write_next();
  }

  /// Closes the connection; what is under way ends with an error.
  void leave() {
    if (std::exchange(has_left_, true)) return;
    for (const auto& [id, topic] : subscriptions_) --hub_.wanted[topic];
    subscriptions_.clear();
    pending_.clear();
    if (is_client_) --hub_.clients;
    if (is_onlooker_) --hub_.onlookers;
    BoostError ignored;
    (ws_ ? beast::get_lowest_layer(*ws_) : stream_).socket().close(ignored);
    hub_.sessions.erase(number_);  // perhaps the last to hold it: nothing after this
  }

 private:
  void answer(const Request& request) {
    if (const char* fault = fault_of(request)) return respond(http::status::forbidden, fault);
    if (websocket::is_upgrade(request)) return upgrade(request);
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return respond(http::status::method_not_allowed, "GET only");
    std::string name = text_of(request.target());
    name = name.substr(1, name.find('?') == name.npos ? name.npos : name.find('?') - 1);
    if (name.empty()) name = "index.html";
    if (const auto content = page_file(name))
      return respond(http::status::ok, *content, media_type(name));
    respond(http::status::not_found, "no such page");
  }

  /// Loopback does not keep a page of somebody else out: it connects from the user's own browser,
  /// under its own name (Origin), or under a name that it made point here (Host).
  [[nodiscard]] const char* fault_of(const Request& request) const {
    const std::string host = text_of(request[http::field::host]);
    if (hub_.is_loopback && !names_this_machine(host, hub_.config.host))
      return "another host was meant";
    const std::string origin = text_of(request[http::field::origin]);
    const bool is_known = origin.empty() || origin == "http://" + host ||
                          std::ranges::count(hub_.config.origins, origin) > 0;
    return is_known ? nullptr : "pages of this origin may not connect (--view-origin)";
  }
  void respond(http::status status, std::string_view content,
               const char* type = "text/plain; charset=utf-8") {
    auto response = std::make_shared<http::response<http::string_body>>(status, 11);
    response->set(http::field::content_type, type);
    response->set(http::field::cache_control, "no-store");
    response->set("Content-Security-Policy",
                  "default-src 'self'; img-src 'self' blob: data:; frame-ancestors 'none'");
    response->set("X-Content-Type-Options", "nosniff");
    response->body().assign(content);
    response->prepare_payload();
    response->keep_alive(false);
    if (parser_.get().method() == http::verb::head) response->body().clear();
    http::async_write(stream_, *response,
                      [self = shared_from_this(), response](BoostError, std::size_t) {
                        BoostError ignored;
                        self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
                        self->leave();
                      });
  }

  void upgrade(const Request& request) {
    const std::string target = text_of(request.target());
    const std::string token = query_value(target, "token");
    may_drive_ = is_same_token(token, hub_.config.token);
    if (target.substr(0, target.find('?')) != "/ws")
      return respond(http::status::not_found, "clients connect to /ws");
    if (!may_drive_ && (!hub_.is_loopback || !token.empty()))
      return respond(http::status::unauthorized, "the token is missing or wrong");
    if (!may_drive_ && hub_.onlookers >= kMostOnlookers)
      return respond(http::status::service_unavailable, "too many look on");
    const auto protocol =
        foxglove::chosen_protocol(text_of(request[http::field::sec_websocket_protocol]));
    if (!protocol)
      return respond(http::status::bad_request, "foxglove.websocket.v1 is what is spoken here");
    is_onlooker_ = !may_drive_;
    hub_.onlookers += is_onlooker_ ? 1 : 0;
    ws_.emplace(std::move(stream_));
    ws_->set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    ws_->set_option(websocket::stream_base::decorator([protocol](websocket::response_type& r) {
      r.set(http::field::sec_websocket_protocol, *protocol);
    }));
    ws_->read_message_max(kLongestMessage);
    beast::get_lowest_layer(*ws_).expires_never();
    ws_->async_accept(request, [self = shared_from_this()](BoostError error) {
      if (error || self->has_left_) return self->leave();
      ++self->hub_.clients;
      self->is_client_ = true;
      self->say(foxglove::server_info());
      self->say(self->hub_.advertisement);
      self->say(foxglove::advertise_services(self->hub_.services));
      self->read_next();
    });
  }

  void read_next() {
    buffer_.clear();
    ws_->async_read(buffer_, [self = shared_from_this()](BoostError error, std::size_t) {
      if (error) return self->leave();
      const std::string message = beast::buffers_to_string(self->buffer_.data());
      if (self->ws_->got_text()) {
        self->hear(foxglove::parse_request(message, self->hub_.topics.size()));
      } else {
        self->hear(foxglove::parse_call(message, self->hub_.services.size()));
      }
      if (!self->has_left_) self->read_next();
    });
  }

  void hear(const Result<foxglove::Subscriptions>& request) {
    if (!request.ok()) return say(foxglove::status(request.error().message));
    bool is_new = false;
    for (const auto& [id, topic] : request->added) {
      if (subscriptions_.size() >= kMostSubscriptions ||
          !subscriptions_.try_emplace(id, topic).second)
        continue;
      is_new |= hub_.wanted[topic]++ == 0;
      if (hub_.last.size() > topic && hub_.last[topic]) pending_[id] = hub_.last[topic];
    }
    for (const std::uint32_t id : request->removed) {
      const auto it = subscriptions_.find(id);
      if (it == subscriptions_.end()) continue;
      --hub_.wanted[it->second];
      subscriptions_.erase(it);
      pending_.erase(id);
    }
    if (is_new) hub_.callbacks.subscribed();
    write_next();
  }

  void hear(const Result<foxglove::Call>& call) {
    if (!call.ok()) return say(foxglove::status(call.error().message));
    if (!may_drive_)
      return say(foxglove::call_failure(*call, "driving needs the token that the run printed"));
    const Result<std::string> done = hub_.callbacks.drive(hub_.services[call->service]);
    say_bytes(foxglove::call_response(*call, done.ok(), done.ok() ? *done : done.error().message));
  }

  void say(std::string text) { queue_control({std::move(text), true}); }
  void say_bytes(std::string bytes) { queue_control({std::move(bytes), false}); }

  struct Control {
    std::string content;
    bool is_text;
  };
  void queue_control(Control control) {
    if (control_.size() >= kMostWaiting) return leave();
    control_.push_back(std::move(control));
    write_next();
  }

  void write_next() {
    if (is_writing_ || has_left_ || !is_client_) return;
    const auto done = [self = shared_from_this()](BoostError error, std::size_t) {
      self->is_writing_ = false;
      if (error) return self->leave();
      self->write_next();
    };
    if (!control_.empty()) {
      now_ = std::move(control_.front());
      control_.pop_front();
      is_writing_ = true;
      ws_->text(now_.is_text);
      return ws_->async_write(asio::buffer(now_.content), done);
    }
    if (pending_.empty()) return;
    // In turn, so that one that is published often does not keep others from being sent.
    auto next = pending_.upper_bound(last_sent_);
    if (next == pending_.end()) next = pending_.begin();
    last_sent_ = next->first;
    message_ = std::move(next->second);
    head_ = foxglove::data_head(next->first, message_->stamp);
    pending_.erase(next);
    is_writing_ = true;
    ws_->binary(true);
    const std::array<asio::const_buffer, 2> parts{asio::buffer(head_), asio::buffer(message_->cdr)};
    ws_->async_write(parts, done);
  }

  Hub& hub_;
  std::uint64_t number_;
  beast::tcp_stream stream_;  // until it is ws_
  std::optional<websocket::stream<beast::tcp_stream>> ws_;
  beast::flat_buffer buffer_;
  http::request_parser<http::empty_body> parser_;
  bool has_asked_ = false, is_client_ = false, is_onlooker_ = false, may_drive_ = false,
       is_writing_ = false, has_left_ = false;
  std::map<std::uint32_t, std::size_t> subscriptions_;  // to topics
  std::map<std::uint32_t, MessagePtr> pending_;         // the newest of each subscription
  std::uint32_t last_sent_ = 0;
  std::deque<Control> control_;
  Control now_;  // being written
  MessagePtr message_;
  foxglove::DataHead head_{};
};

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
  void publish(std::string_view topic, Timestamp stamp, Bytes cdr) override {
    const std::size_t index = hub_.topic_index(topic);
    CHECK(index < hub_.topics.size(), "a topic that was advertised");
    auto message = std::make_shared<const foxglove::Data>(foxglove::Data{stamp, std::move(cdr)});
    asio::post(io_, [this, index, message] {
      hub_.last[index] = message;
      const auto sessions = hub_.sessions;  // a session may leave meanwhile
      for (const auto& [number, session] : sessions) session->offer(index, message);
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
    const std::shared_ptr<Session> silent = it->second;
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
        const auto session = std::make_shared<Session>(hub_, number, std::move(socket));
        hub_.sessions.emplace(number, session);
        session->start();
      }
      if (acceptor_.is_open()) accept_next();
    });
  }

  asio::io_context io_{1};
  Hub hub_;
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
