// Who may look on and who may drive: tokens, and the names a request comes under.
#pragma once

#include <string>
#include <string_view>

namespace ygslam {

/// 128 bits that nobody guesses, in hexadecimal digits.
[[nodiscard]] std::string new_token();
/// Takes as long wherever they differ.
[[nodiscard]] bool is_same_token(std::string_view a, std::string_view b);
/// The value of a key in what follows the `?` of a request's target; empty if there is none.
[[nodiscard]] std::string query_value(std::string_view target, std::string_view key);
/// Whether a request's Host is this machine's own name or address. The port may be another one
/// here than there: ssh -L 9000:127.0.0.1:8765.
/// @param own_address that the server listens at.
[[nodiscard]] bool names_this_machine(std::string_view host, std::string_view own_address);

}  // namespace ygslam
