// SIGHUP, SIGINT and SIGTERM end a run in good order; a second one ends the process at once.
#pragma once

#include <atomic>

namespace ygslam {

class StopSignal {
 public:
  /// From now to the end of the process: a signal that comes while it leaves does not turn work
  /// that is done into a process that was killed.
  static void watch();
  /// @return the signal's number, 0 if none came.
  static int received();
  /// Set once one came: for computations that can be given up.
  static const std::atomic<bool>& flag();
  /// What came ended a wait alone, and no work: the command has done all it should.
  static void forget();
};

}  // namespace ygslam
