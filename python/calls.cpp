#include "calls.hpp"

#include <cxxabi.h>
#include <pthread.h>
#include <unistd.h>

#include <mutex>
#include <set>
#include <stdexcept>

namespace ygslam::python {

/// All of the process, which has one interpreter.
struct KeptSlams {
  std::mutex mutex;
  std::set<KeptSlam*> all;

  void end() {
    for (KeptSlam* one : all) one->slam_.reset();
  }
  /// A forked child has one thread, which used none of them; they are its parent's.
  void forget() {
    for (KeptSlam* one : all) one->in_use_ = false;
    all.clear();
  }
};

namespace {

std::atomic<int> calls_under_way{0};  // without the interpreter's lock
KeptSlams kept;

/// The interpreter has ended: no thread can begin a call any more.
void end_all() {
  for (int under_way = calls_under_way; under_way > 0; under_way = calls_under_way)
    calls_under_way.wait(under_way);
  kept.end();
}

void before_fork() { kept.mutex.lock(); }
void after_fork_in_parent() { kept.mutex.unlock(); }
void after_fork_in_child() {
  calls_under_way = 0;
  kept.forget();
  kept.mutex.unlock();
}

}  // namespace

Unlocked::Unlocked() {
  ++calls_under_way;
  state_ = PyEval_SaveThread();
}

Unlocked::~Unlocked() {
  --calls_under_way;
  calls_under_way.notify_all();
  try {
    PyEval_RestoreThread(state_);
  } catch (const abi::__forced_unwind&) {
    for (;;) ::pause();
  }
}

KeptSlam::KeptSlam(const api::Settings& settings) : slam_(api::Slam::open(settings)) {
  const std::lock_guard lock(kept.mutex);
  kept.all.insert(this);
}

KeptSlam::~KeptSlam() {
  const std::lock_guard lock(kept.mutex);
  kept.all.erase(this);
}

bool KeptSlam::is_at_home() {
  const std::lock_guard lock(kept.mutex);
  return kept.all.contains(this);
}

SlamUse::SlamUse(KeptSlam& slam) : slam_(slam) {
  if (slam_.in_use_.exchange(true))
    throw std::runtime_error("another thread is using this Slam: one at a time may");
}

void end_calls_with_the_interpreter() {
  static_cast<void>(Py_AtExit(end_all));
  static_cast<void>(::pthread_atfork(before_fork, after_fork_in_parent, after_fork_in_child));
}

}  // namespace ygslam::python
