// Work that a hostile file may bring down, tried in a child process first.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>

#include "core/result.hpp"

namespace ygslam {

/// What a child process may use before it is stopped. Endless work ends after `cpu` on any machine;
/// `wall` is generous, for a busy machine must not condemn a good file.
struct ChildLimits {
  std::chrono::seconds cpu{3};
  std::chrono::milliseconds wall{15000};
  std::uint64_t extra_bytes = std::uint64_t{4} << 30;  ///< beyond what is in use at the start
};

/// Runs `work` in a forked child and waits for its answer. What it prints is discarded.
///
/// fork() copies only the calling thread. `work` therefore must not rely on threads that the
/// process runs already: reading a network is fine at any time, compiling or running one is fine
/// only before the first is compiled in this process.
///
/// @param name of the file at hand, for the message.
/// @return the child's own answer; an error of kind kModel if it crashed or reached a limit;
/// kInternal if no child could be started.
[[nodiscard]] Status try_in_child(const std::function<Status()>& work, const std::string& name,
                                  const ChildLimits& limits = {});

}  // namespace ygslam
