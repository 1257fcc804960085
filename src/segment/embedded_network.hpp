// The networks built into the library.
#pragma once

#include <optional>
#include <string_view>

namespace ygslam {

/// @param name of a file of assets/, e.g. "people.onnx". @return nullopt if it was not there when
/// the library was built.
[[nodiscard]] std::optional<std::string_view> embedded_network(std::string_view name);

}  // namespace ygslam
