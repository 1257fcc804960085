#include "live/foxglove_protocol.hpp"

#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

namespace ygslam::foxglove {
namespace {

using Json = nlohmann::json;

constexpr std::uint8_t kMessageData = 1, kServiceCallResponse = 3, kServiceCallRequest = 2;

struct TriggerResponse {
  std::uint8_t success = 0;
  std::string message;
  template <typename Self, typename Cdr>
  static void fields(Self& m, Cdr& cdr) {
    cdr(m.success, m.message);
  }
};

template <typename T>
void put(std::uint8_t* at, T value) {
  std::memcpy(at, &value, sizeof value);
}

std::uint32_t number_at(const std::string& bytes, std::size_t at) {
  std::uint32_t number = 0;
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

Error fault(const std::string& what) { return {ErrorKind::kInput, what}; }

std::optional<std::uint32_t> number_in(const Json& json, const char* key) {
  const auto it = json.find(key);
  if (it == json.end() || !it->is_number_unsigned() || *it > 0xffffffffU) return std::nullopt;
  return it->get<std::uint32_t>();
}

}  // namespace

std::optional<std::string> chosen_protocol(const std::string& offered) {
  std::istringstream names(offered);
  for (std::string name; std::getline(names, name, ',');) {
    name.erase(0, name.find_first_not_of(' '));
    name.erase(name.find_last_not_of(' ') + 1);
    if (name == "foxglove.websocket.v1" || name == "foxglove.sdk.v1") return name;
  }
  return std::nullopt;
}

std::string server_info() {
  return Json{{"op", "serverInfo"},
              {"name", "ygslam"},
              {"capabilities", {"services"}},
              {"supportedEncodings", {"cdr"}},
              {"metadata", Json::object()}}
      .dump();
}

std::string advertise(std::span<const Topic> topics) {
  Json channels = Json::array();
  for (const Topic& topic : topics)
    channels.push_back({{"id", channels.size() + 1},
                        {"topic", topic.name},
                        {"encoding", "cdr"},
                        {"schemaName", topic.type},
                        {"schemaEncoding", "ros2msg"},
                        {"schema", ros::schema_of(topic.type)}});
  return Json{{"op", "advertise"}, {"channels", std::move(channels)}}.dump();
}

std::string advertise_services(std::span<const std::string> names) {
  Json services = Json::array();
  for (const std::string& name : names) {
    const auto part = [](const char* half, const char* schema) {
      return Json{{"encoding", "cdr"},
                  {"schemaName", std::string("std_srvs/srv/Trigger_") + half},
                  {"schemaEncoding", "ros2msg"},
                  {"schema", schema}};
    };
    services.push_back({{"id", services.size() + 1},
                        {"name", name},
                        {"type", "std_srvs/srv/Trigger"},
                        {"request", part("Request", "")},
                        {"response", part("Response", "bool success\nstring message\n")}});
  }
  return Json{{"op", "advertiseServices"}, {"services", std::move(services)}}.dump();
}

std::string status(const std::string& complaint) {
  return Json{{"op", "status"}, {"level", 1}, {"message", complaint}}.dump();
}

DataHead data_head(std::uint32_t subscription, Timestamp stamp) {
  DataHead head{kMessageData};
  put(head.data() + 1, subscription);
  put(head.data() + 5, stamp.ns);
  return head;
}

Result<Subscriptions> parse_request(const std::string& text, std::size_t topics) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("op") || !json["op"].is_string())
    return fault("a JSON object with `op` is expected");
  Subscriptions result;
  const Json none = Json::array();
  const auto list = [&](const char* key) -> const Json& {  // no copy: it may be nested deep
    const auto it = json.find(key);
    return it != json.end() && it->is_array() ? *it : none;
  };
  if (json["op"] == "subscribe") {
    for (const Json& subscription : list("subscriptions")) {
      const auto id = number_in(subscription, "id"), channel = number_in(subscription, "channelId");
      if (!id || !channel || *channel == 0 || *channel > topics)
        return fault("subscribe: there is no such channel");
      result.added[*id] = *channel - 1;
    }
  } else if (json["op"] == "unsubscribe") {
    for (const Json& id : list("subscriptionIds"))
      if (id.is_number_unsigned() && id <= 0xffffffffU)
        result.removed.push_back(id.get<std::uint32_t>());
  }
  return result;
}

Result<Call> parse_call(const std::string& bytes, std::size_t services) {
  constexpr std::size_t kHead = 1 + 4 + 4 + 4;
  if (bytes.size() < kHead || bytes[0] != kServiceCallRequest)
    return fault("only calls of services are understood in bytes");
  const std::uint32_t service = number_at(bytes, 1);
  if (service == 0 || service > services) return fault("there is no such service");
  return Call{service - 1, number_at(bytes, 5)};
}

std::string call_response(const Call& call, bool success, const std::string& message) {
  const Bytes cdr = to_cdr(TriggerResponse{static_cast<std::uint8_t>(success), message});
  constexpr std::string_view kEncoding = "cdr";
  std::string bytes(1 + 4 + 4 + 4, '\0');
  auto* head = reinterpret_cast<std::uint8_t*>(bytes.data());
  head[0] = kServiceCallResponse;
  put(head + 1, static_cast<std::uint32_t>(call.service + 1));
  put(head + 5, call.id);
  put(head + 9, static_cast<std::uint32_t>(kEncoding.size()));
  bytes += kEncoding;
  bytes.append(cdr.begin(), cdr.end());
  return bytes;
}

std::string call_failure(const Call& call, const std::string& why) {
  return Json{{"op", "serviceCallFailure"},
              {"serviceId", call.service + 1},
              {"callId", call.id},
              {"message", why}}
      .dump();
}

}  // namespace ygslam::foxglove
