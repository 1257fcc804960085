#include "app/stop_signal.hpp"

#include <unistd.h>

#include <array>
#include <csignal>

namespace ygslam {
namespace {

// A signal handler can reach nothing but a global of this kind.
volatile std::sig_atomic_t received_signal = 0;
std::atomic<bool> is_received{false};
static_assert(std::atomic<bool>::is_always_lock_free);

constexpr std::array kSignals = {SIGHUP, SIGINT, SIGTERM};

void handle(int signal) {
  if (received_signal) _exit(128 + signal);
  received_signal = signal;
  is_received.store(true);
}

/// `nohup` ignores it, and the run goes on when the terminal closes.
bool is_ignored(int signal) {
  struct sigaction now {};
  return signal == SIGHUP && sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
}

}  // namespace

void StopSignal::watch() {
  forget();
  struct sigaction action {};
  action.sa_handler = handle;
  for (const int signal : kSignals)
    if (!is_ignored(signal)) sigaction(signal, &action, nullptr);
}

int StopSignal::received() { return received_signal; }

const std::atomic<bool>& StopSignal::flag() { return is_received; }

void StopSignal::forget() {
  received_signal = 0;
  is_received.store(false);
}

}  // namespace ygslam
