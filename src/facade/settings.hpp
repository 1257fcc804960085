// What the library's public objects have in common: their settings, and what may leave them.
#pragma once

#include "core/log.hpp"
#include "system/failure.hpp"
#include "system/session.hpp"
#include "ygslam/slam.hpp"

namespace ygslam::api {

[[noreturn]] inline void fail(const ygslam::Error& error) {
  throw Error(static_cast<int>(error.kind), error.message);
}

/// @throws Error (2) of an object that was moved from
template <typename Impl>
[[nodiscard]] Impl& alive(const std::unique_ptr<Impl>& impl, const char* call) {
  if (!impl) fail({ErrorKind::kUsage, std::string(call) + " of an object that was moved from"});
  return *impl;
}

/// Without the camera. @throws Error (3)
[[nodiscard]] SessionOptions session_options(const Settings& settings);
/// @throws Error (3)
[[nodiscard]] CameraConfig to_config(const CameraModel& camera);
/// Null where the settings name none.
[[nodiscard]] log::SinkPtr sink_of(const Settings& settings);

/// The library's border: nothing but Error leaves it.
template <typename Work>
auto guarded(const log::SinkPtr& sink, const Work& work) {
  const log::ScopedSink scope(sink);
  try {
    return work();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    fail({ErrorKind::kInternal, describe(e)});
  } catch (...) {
    fail({ErrorKind::kInternal, "internal: unknown exception"});
  }
}

}  // namespace ygslam::api
