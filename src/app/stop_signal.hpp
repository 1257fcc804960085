// SIGHUP, SIGINT and SIGTERM end a run in good order; a second one ends the process at once.
#pragma once

namespace ygslam {

class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  /// @return the signal's number, 0 if none came.
  static int received();
};

}  // namespace ygslam
