#include "live/view_session.hpp"

#include <netinet/tcp.h>
#include <array>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <optional>

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

constexpr int kMostOnlookers = 56;  // of all clients, so that who has the token finds a place
constexpr std::size_t kMostSubscriptions = 32;  // of a client
constexpr std::size_t kMostWaiting = 256;       // texts to a client that does not read them
constexpr std::size_t kLongestMessage = 1 << 16;
constexpr std::uint32_t kLongestHead = 1 << 13;
constexpr auto kHandshake = std::chrono::seconds(5);

using Request = http::request<http::empty_body>;

std::string text_of(beast::string_view view) { return {view.data(), view.size()}; }

const char* media_type(std::string_view name) {
  if (name.ends_with(".html")) return "text/html; charset=utf-8";
  if (name.ends_with(".js")) return "text/javascript; charset=utf-8";
  if (name.ends_with(".css")) return "text/css; charset=utf-8";
  return "application/octet-stream";
}

class BeastViewSession : public ViewSession, public std::enable_shared_from_this<BeastViewSession> {
 public:
  BeastViewSession(ViewHub& hub, std::uint64_t number, tcp::socket socket)
      : hub_(hub), number_(number), stream_(std::move(socket)) {
    parser_.header_limit(kLongestHead);
    parser_.body_limit(0);
  }

  void start() override {
    stream_.expires_after(kHandshake);
    http::async_read(stream_, buffer_, parser_,
                     [self = shared_from_this()](BoostError error, std::size_t) {
                       if (error || self->has_left_) return self->leave();
                       self->has_asked_ = true;
                       self->answer(self->parser_.get());
                     });
  }

  [[nodiscard]] bool has_asked() const override { return has_asked_; }

  void offer(std::span<const Offer> offers) override {
    for (const auto& [subscription, topic] : subscriptions_)
      for (const Offer& offer : offers)
        if (offer.topic == topic) pending_[subscription].parts[offer.part] = offer.message;
    write_next();
  }

  void leave() override {
    if (std::exchange(has_left_, true)) return;
    for (const auto& [id, topic] : subscriptions_) --hub_.wanted[topic];
    subscriptions_.clear();
    pending_.clear();
    if (is_client_) --hub_.clients;
    if (is_onlooker_) --hub_.onlookers;
    BoostError ignored;
    socket().close(ignored);
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
      if (!hub_.last[topic].empty()) pending_[id].parts = hub_.last[topic];
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
    if (pending_.empty()) return cork(false);
    if (pending_.size() > 1) cork(true);
    // In turn, so that one that is published often, or in many parts, does not keep others from
    // being sent.
    const auto next = after(pending_, last_sent_);
    last_sent_ = next->first;
    Pending& pending = next->second;
    const auto part = after(pending.parts, pending.last_sent);
    pending.last_sent = part->first;
    message_ = std::move(part->second);
    head_ = foxglove::data_head(next->first, message_->stamp);
    pending.parts.erase(part);
    if (pending.parts.empty()) pending_.erase(next);
    is_writing_ = true;
    ws_->binary(true);
    const std::array<asio::const_buffer, 2> parts{asio::buffer(head_), asio::buffer(message_->cdr)};
    ws_->async_write(parts, done);
  }

  /// The entry behind that of a key, the first behind the last. @param entries at least one.
  template <typename Entries>
  static typename Entries::iterator after(Entries& entries, std::uint32_t key) {
    const auto next = entries.upper_bound(key);
    return next == entries.end() ? entries.begin() : next;
  }

  tcp::socket& socket() { return (ws_ ? beast::get_lowest_layer(*ws_) : stream_).socket(); }

  /// Messages that go out together share packets: sending each by itself was most of what the
  /// server's thread did.
  void cork(bool more_follows) {
    if (std::exchange(is_corked_, more_follows) == more_follows) return;
    const int on = more_follows ? 1 : 0;
    (void)::setsockopt(socket().native_handle(), IPPROTO_TCP, TCP_CORK, &on, sizeof on);
  }

  ViewHub& hub_;
  std::uint64_t number_;
  beast::tcp_stream stream_;  // until it is ws_
  std::optional<websocket::stream<beast::tcp_stream>> ws_;
  beast::flat_buffer buffer_;
  http::request_parser<http::empty_body> parser_;
  bool has_asked_ = false, is_client_ = false, is_onlooker_ = false, may_drive_ = false,
       is_writing_ = false, is_corked_ = false, has_left_ = false;
  std::map<std::uint32_t, std::size_t> subscriptions_;  // to topics
  struct Pending {
    ViewParts parts;  // at least one
    std::uint32_t last_sent = 0;
  };
  std::map<std::uint32_t, Pending> pending_;  // the newest of each subscription
  std::uint32_t last_sent_ = 0;
  std::deque<Control> control_;
  Control now_;  // being written
  ViewMessagePtr message_;
  foxglove::DataHead head_{};
};

}  // namespace

std::shared_ptr<ViewSession> new_view_session(ViewHub& hub, std::uint64_t number,
                                              tcp::socket socket) {
  return std::make_shared<BeastViewSession>(hub, number, std::move(socket));
}

}  // namespace ygslam
