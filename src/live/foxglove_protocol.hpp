// The messages of Foxglove's WebSocket protocol, version 1 (github.com/foxglove/ws-protocol,
// docs/spec.md): what is said in JSON, and the heads of what is said in bytes.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "live/topics.hpp"

namespace ygslam::foxglove {

struct Data {
  Timestamp stamp;
  Bytes cdr;
};

/// The first of the protocol's names in what a client offers; both mean the same.
[[nodiscard]] std::optional<std::string> chosen_protocol(const std::string& offered);

// Channels and services are numbered from 1 in the order of topics and services.
[[nodiscard]] std::string server_info();
[[nodiscard]] std::string advertise(std::span<const Topic> topics);
[[nodiscard]] std::string advertise_services(std::span<const std::string> services);
[[nodiscard]] std::string status(const std::string& complaint);

using DataHead = std::array<std::uint8_t, 13>;
/// What comes before a message's CDR.
[[nodiscard]] DataHead data_head(std::uint32_t subscription, Timestamp stamp);

struct Subscriptions {
  std::map<std::uint32_t, std::size_t> added;  ///< the client's number to the topic's index
  std::vector<std::uint32_t> removed;
};
/// What a client said in JSON; nothing for operations that are not served.
/// @return kInput if it is no JSON, or names a channel that is not there.
[[nodiscard]] Result<Subscriptions> parse_request(const std::string& text, std::size_t topics);

struct Call {
  std::size_t service = 0;  ///< index
  std::uint32_t id = 0;     ///< the client's
};
/// What a client said in bytes. @return kInput if it is no call of a service that is there.
[[nodiscard]] Result<Call> parse_call(const std::string& bytes, std::size_t services);
/// std_srvs/Trigger's response, in bytes.
[[nodiscard]] std::string call_response(const Call& call, bool success, const std::string& message);
/// In JSON.
[[nodiscard]] std::string call_failure(const Call& call, const std::string& why);

}  // namespace ygslam::foxglove
