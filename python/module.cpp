// ygslam._core: the library's facade for Python. Arrays are read where they lie; the interpreter's
// lock is released while a call works.
#include <array>
#include <string>

#include "bindings.hpp"
#include "calls.hpp"

namespace nb = nanobind;

namespace ygslam::python {
namespace {

/// ygslam.Error and its kinds, each with the exit code of the command line as `code`.
void bind_errors(nb::module_& m) {
  struct Kind {
    int code;
    const char* name;
    const char* what;
  };
  static constexpr std::array kKinds = {
      Kind{2, "UsageError", "Wrong use; `code` is 2."},
      Kind{3, "ConfigError", "Settings or camera; `code` is 3."},
      Kind{4, "InputError", "A recording, or a frame of it; `code` is 4."},
      Kind{5, "ModelError", "The network; `code` is 5."},
      Kind{6, "MapError", "A saved map; `code` is 6."},
      Kind{9, "OutputError", "What could not be written; `code` is 9."}};
  static PyObject* const error =  // for as long as the interpreter lives
      PyErr_NewExceptionWithDoc("ygslam.Error",
                                "What went wrong in one line; `code` as the exit codes of the "
                                "command line: 1 a bug or out of memory, 2 wrong use, 3 settings "
                                "or camera, 4 input, 5 model, 6 map file, 9 not written.",
                                PyExc_RuntimeError, nullptr);
  m.attr("Error") = nb::handle(error);
  static std::array<PyObject*, kKinds.size()> kinds{};
  for (std::size_t i = 0; i < kKinds.size(); ++i) {
    const std::string name = std::string("ygslam.") + kKinds[i].name;
    kinds[i] = PyErr_NewExceptionWithDoc(name.c_str(), kKinds[i].what, error, nullptr);
    m.attr(kKinds[i].name) = nb::handle(kinds[i]);
  }
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const api::Error& e) {
      PyObject* kind = error;
      for (std::size_t i = 0; i < kKinds.size(); ++i)
        if (kKinds[i].code == static_cast<int>(e.code)) kind = kinds[i];
      nb::object instance = nb::handle(kind)(e.what());
      instance.attr("code") = e.code;
      PyErr_SetObject(kind, instance.ptr());
    }
  });
}

}  // namespace

NB_MODULE(_core, m) {
  m.doc() = "YG-SLAM: RGB-D SLAM for rooms with people in them.";
  m.attr("__version__") = YGSLAM_VERSION;
  end_calls_with_the_interpreter();
  nb::set_leak_warnings(false);  // what a daemon thread was using is left, and no fault
  bind_errors(m);
  bind_camera(m);
  bind_imu(m);
  bind_wheels(m);
  bind_results(m);
  bind_room(m);
  bind_slam(m);
  bind_ros_images(m);
  bind_sequence(m);
}

}  // namespace ygslam::python
