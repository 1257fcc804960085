// Logging goes to stderr and, during a run, to the run's log.txt; data goes to stdout.
#pragma once

#include <spdlog/spdlog.h>

namespace ygslam {
namespace log = spdlog;
}
