#include <algorithm>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "live/foxglove_protocol.hpp"

namespace ygslam::fuzz {

/// What a client of the live page is understood to want is there.
void live_requests(std::string_view bytes) {
  constexpr std::size_t kTopics = 3, kServices = 2;
  const std::string message(bytes);
  (void)foxglove::chosen_protocol(message);
  const auto request = foxglove::parse_request(message, kTopics);
  if (request.ok())
    for (const auto& [id, topic] : request->added) CHECK(topic < kTopics);
  const auto call = foxglove::parse_call(message, kServices);
  if (call.ok()) CHECK(call->service < kServices);
}

}  // namespace ygslam::fuzz
