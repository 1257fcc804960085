// What the library's public objects have in common: their settings, and what may leave them.
#pragma once

#include <unistd.h>

#include "core/log.hpp"
#include "core/printable.hpp"
#include "io/depth_registration.hpp"
#include "scene/scene.hpp"
#include "system/failure.hpp"
#include "system/session.hpp"
#include "ygslam/slam.hpp"

namespace ygslam::api {

[[noreturn]] inline void fail(const ygslam::Error& error) {
  throw Error(static_cast<int>(error.kind), one_line(error.message));
}

/// @throws Error (2) of an object that was moved from, or made before a fork
template <typename Impl>
[[nodiscard]] Impl& alive(const std::unique_ptr<Impl>& impl, const char* call) {
  if (!impl) fail({ErrorKind::kUsage, std::string(call) + " of an object that was moved from"});
  impl->home.require(call);
  return *impl;
}

/// The process an object was made in. A fork copies the object without its threads: in the child it
/// can neither be used nor be ended, for both would wait for these.
class HomeProcess {
 public:
  [[nodiscard]] bool is_here() const { return ::getpid() == process_; }
  /// @throws Error (2)
  void require(const char* call) const {
    if (!is_here())
      fail({ErrorKind::kUsage,
            std::string(call) +
                " in a forked child: the object belongs to the process that made it; make one in "
                "the child"});
  }

 private:
  pid_t process_ = ::getpid();
};

/// In a forked child what the object holds is left as it is.
template <typename Impl>
void end_at_home(std::unique_ptr<Impl>& impl) noexcept {
  if (impl && !impl->home.is_here()) static_cast<void>(impl.release());
  impl.reset();
}

/// Without the camera. @throws Error (3)
[[nodiscard]] SessionOptions session_options(const Settings& settings);
/// @throws Error (3)
[[nodiscard]] CameraConfig to_config(const CameraModel& camera);
/// For messages; empty: the caller.
[[nodiscard]] std::string shutter_source_of(const CameraModel& camera);
/// Null where depth is registered. @throws Error (3)
[[nodiscard]] std::shared_ptr<const DepthRegistration> registration_of(const Settings& settings,
                                                                       const CameraConfig& colour);
/// The one that is given.
[[nodiscard]] std::optional<Gravity> floor_of(const Settings& settings);
/// @throws Error (3)
[[nodiscard]] ImuCalibration to_calibration(const Imu& imu);
[[nodiscard]] WheelCalibration to_calibration(const Wheels& wheels);
/// Of a camera whose other numbers come from elsewhere, its size among them.
void ignore_pixels(const CameraModel& from, CameraConfig& to);
/// That of the settings, else standard error for warnings and errors. Lines are one_line().
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
