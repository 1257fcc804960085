// libFuzzer's entry to the target that the build names.
#include <cstddef>
#include <cstdint>

#include "core/log.hpp"
#include "fuzz/targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto silence =
      std::make_shared<const ygslam::log::Sink>([](ygslam::log::Level, const std::string&) {});
  const ygslam::log::ScopedSink scope(silence);
  ygslam::fuzz::YGSLAM_FUZZ_TARGET({reinterpret_cast<const char*>(data), size});
  return 0;
}
