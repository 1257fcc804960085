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
  /// What came ended a wait alone, and no work: the command has done all it should.
  static void forget();
};

}  // namespace ygslam
