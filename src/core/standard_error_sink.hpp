// Where lines go that nobody asked for: standard error.
#pragma once

#include <cstdio>
#include <memory>

#include "core/log.hpp"
#include "core/printable.hpp"

namespace ygslam {

/// Warnings and errors, as lines that can be shown as they are.
[[nodiscard]] inline log::SinkPtr standard_error_sink() {
  return std::make_shared<const log::Sink>([](log::Level level, const std::string& line) {
    if (level == log::Level::kInfo) return;
    std::fprintf(stderr, "%s: %s\n", level == log::Level::kError ? "error" : "warning",
                 one_line(line).c_str());
  });
}

}  // namespace ygslam
