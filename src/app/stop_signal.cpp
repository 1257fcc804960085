#include "app/stop_signal.hpp"

#include <unistd.h>
#include <csignal>

namespace ygslam {
namespace {

// A signal handler can reach nothing but a global of this kind.
volatile std::sig_atomic_t received_signal = 0;

void handle(int signal) {
  if (received_signal) _exit(128 + signal);
  received_signal = signal;
}

}  // namespace

StopSignal::StopSignal() {
  received_signal = 0;
  struct sigaction action {};
  action.sa_handler = handle;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

StopSignal::~StopSignal() {
  struct sigaction action {};
  action.sa_handler = SIG_DFL;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int StopSignal::received() { return received_signal; }

}  // namespace ygslam
