// What a command ends with.
#pragma once

#include "app/stop_signal.hpp"
#include "core/log.hpp"
#include "core/result.hpp"

namespace ygslam {

/// The command's own code; of an error, which is logged, that of its kind.
[[nodiscard]] inline int exit_code_of(const Result<int>& code) {
  if (code.ok()) return *code;
  log::error("{}", code.error().message);
  return static_cast<int>(code.error().kind);
}

/// 0, 128 + the signal that ended the work early, or the code of the error, which is logged.
[[nodiscard]] inline int exit_code_of(const Status& status) {
  const int signal = StopSignal::received();
  return exit_code_of(status.ok() ? Result<int>(signal == 0 ? 0 : 128 + signal)
                                  : Result<int>(status.error()));
}

}  // namespace ygslam
