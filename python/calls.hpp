// Work of ours on behalf of the interpreter: without its lock, and in good order when it ends.
#pragma once

#include <Python.h>

#include <ygslam/slam.hpp>

#include <atomic>
#include <optional>

namespace ygslam::python {

/// The interpreter's lock is given up while this lives. A daemon thread that wants it back when the
/// interpreter has ended does not get it: it waits for the end of the process. (Before Python 3.14
/// such a thread is unwound, which ends in abort() at the first function that must not throw.)
class Unlocked {
 public:
  Unlocked();
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;
  ~Unlocked();

 private:
  PyThreadState* state_;
};

/// A Slam that is ended before the process takes down what its threads stand on, also where the
/// interpreter leaves its object behind, as it does with those that a daemon thread was using.
class KeptSlam {
 public:
  explicit KeptSlam(const api::Settings& settings);
  KeptSlam(const KeptSlam&) = delete;
  KeptSlam& operator=(const KeptSlam&) = delete;
  ~KeptSlam();

  api::Slam* operator->() { return &*slam_; }
  const api::Slam* operator->() const { return &*slam_; }
  /// False in a child made by fork(), which cannot use it.
  [[nodiscard]] bool is_at_home();

 private:
  friend class SlamUse;
  friend struct KeptSlams;
  std::optional<api::Slam> slam_;
  std::atomic<bool> in_use_{false};
};

/// A call that works with a Slam. One thread at a time: a second one is told so instead of racing.
class SlamUse {
 public:
  /// @throws std::runtime_error
  explicit SlamUse(KeptSlam& slam);
  SlamUse(const SlamUse&) = delete;
  SlamUse& operator=(const SlamUse&) = delete;
  ~SlamUse() { slam_.in_use_ = false; }

 private:
  Unlocked unlocked_;
  KeptSlam& slam_;
};

/// To be called once, when the module is loaded.
void end_calls_with_the_interpreter();

}  // namespace ygslam::python
