#include "system/failure.hpp"

#include <new>
#include <opencv2/core.hpp>
#include <system_error>

namespace ygslam {
namespace {

bool is_out_of_memory(const std::exception& failure) {
  if (dynamic_cast<const std::bad_alloc*>(&failure)) return true;
  if (const auto* opencv = dynamic_cast<const cv::Exception*>(&failure))
    return opencv->code == cv::Error::StsNoMem;
  // A thread that cannot be started for want of a stack.
  const auto* system = dynamic_cast<const std::system_error*>(&failure);
  return system && (system->code() == std::errc::resource_unavailable_try_again ||
                    system->code() == std::errc::not_enough_memory);
}

}  // namespace

std::string describe(const std::exception& failure) {
  if (is_out_of_memory(failure)) return "out of memory";
  return std::string("internal: ") + failure.what();
}

}  // namespace ygslam
