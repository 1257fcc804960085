#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>

#include <filesystem>
#include <ygslam/slam.hpp>

#include "bag/bag.hpp"
#include "bag/bag_sequence.hpp"
#include "bindings.hpp"
#include "calls.hpp"
#include "core/printable.hpp"
#include "core/standard_error_sink.hpp"
#include "geometry/rolling_shutter.hpp"
#include "io/atomic_file.hpp"
#include "io/frame_loader.hpp"
#include "io/image_folders.hpp"
#include "text.hpp"

namespace nb = nanobind;

namespace ygslam::python {
namespace {

struct Frame {
  RgbdFrame content;

  [[nodiscard]] std::int64_t depth_t_ns() const {
    return content.stamp.ns + to_ns(content.depth_delay_s);
  }
};

[[noreturn]] void fail(const Error& error) {
  throw api::Error(static_cast<int>(error.kind), one_line(error.message));
}

class Sequence {
 public:
  explicit Sequence(const std::filesystem::path& path) : sequence_(open(path)) {}

  [[nodiscard]] std::size_t size() const { return sequence_.pairs.size(); }
  [[nodiscard]] Frame frame(std::int64_t i) const {
    const auto n = static_cast<std::int64_t>(size());
    if (i < 0) i += n;
    if (i < 0 || i >= n) throw nb::index_error("no such frame");
    const Unlocked unlocked;
    auto loaded = load_frame(sequence_, static_cast<std::size_t>(i));
    if (!loaded.ok()) fail(loaded.error());
    return {std::move(loaded).value()};
  }
  [[nodiscard]] api::CameraModel camera() const {
    const CameraConfig& c = sequence_.camera;
    api::CameraModel model;
    model.fx = c.fx, model.fy = c.fy, model.cx = c.cx, model.cy = c.cy;
    model.k1 = c.k1, model.k2 = c.k2, model.p1 = c.p1, model.p2 = c.p2, model.k3 = c.k3;
    model.width = c.width, model.height = c.height;
    model.colour_readout_ms = c.colour_readout_ms;
    model.depth_readout_ms = c.depth_readout_ms;
    model.depth_delay_ms = c.depth_delay_ms;
    model.shutter_known = c.shutter_known;
    model.shutter_guessed = !c.shutter_known && !shutter_times(c).is_global();
    for (const PixelRectangle& r : c.ignored) model.ignore.push_back({r.u, r.v, r.width, r.height});
    model.likely_device = sequence_.likely_device;
    model.shutter_source = sequence_.shutter_source;
    return model;
  }

 private:
  static ygslam::Sequence open(const std::filesystem::path& path) {
    const log::ScopedSink sink(standard_error_sink());
    auto sequence = is_bag(path) ? open_bag_sequence(path, {}, {}) : open_folder_sequence(path);
    if (!sequence.ok()) fail(sequence.error());
    return std::move(sequence).value();
  }
  ygslam::Sequence sequence_;
};

/// One frame after the other; of a sequence that it keeps alive.
struct FrameIterator {
  nb::object sequence;
  std::int64_t next = 0;

  Frame step() {
    const auto& frames = nb::cast<const Sequence&>(sequence);
    if (next >= static_cast<std::int64_t>(frames.size())) throw nb::stop_iteration();
    return frames.frame(next++);
  }
};

std::string text_of(const Frame& f) {
  const ColourImage& image = f.content.colour;
  return text("Frame(t_ns={}, {} x {} pixels)", f.content.stamp.ns, image.width(), image.height());
}

}  // namespace

void bind_sequence(nb::module_& m) {
  m.def(
      "write_file",
      [](const std::filesystem::path& path, const std::string& text) {
        const Status written = write_file_atomically(path, text);
        if (!written.ok()) fail(written.error());
      },
      nb::arg("path"), nb::arg("text"), "The whole file or none.");
  nb::class_<Frame>(m, "Frame", "A registered pair of images.")
      .def_prop_ro(
          "t_ns", [](const Frame& f) { return f.content.stamp.ns; }, "of the colour image")
      .def_prop_ro("depth_t_ns", &Frame::depth_t_ns, "of the depth image")
      .def_prop_ro(
          "rgb",
          [](Frame& f) {
            const ColourImage& image = f.content.colour;
            return nb::ndarray<nb::numpy, const std::uint8_t, nb::shape<-1, -1, 3>, nb::c_contig>(
                image.data(),
                {static_cast<std::size_t>(image.height()), static_cast<std::size_t>(image.width()),
                 3},
                nb::find(f));
          },
          nb::rv_policy::automatic, "(H, W, 3) uint8")
      .def_prop_ro(
          "depth",
          [](Frame& f) {
            const DepthImage& image = f.content.depth_m;
            return nb::ndarray<nb::numpy, const float, nb::ndim<2>, nb::c_contig>(
                image.data(),
                {static_cast<std::size_t>(image.height()), static_cast<std::size_t>(image.width())},
                nb::find(f));
          },
          nb::rv_policy::automatic, "(H, W) float32 [m], 0 = none")
      .def("__repr__", &text_of);
  nb::class_<FrameIterator>(m, "FrameIterator", "Goes over a Sequence.")
      .def(
          "__iter__", [](nb::object self) { return self; },
          nb::sig("def __iter__(self) -> FrameIterator"))
      .def("__next__", &FrameIterator::step);
  nb::class_<Sequence>(m, "Sequence", "A recorded sequence: its camera and its frames.")
      .def(nb::init<const std::filesystem::path&>(), nb::arg("path"),
           "path: what `ygslam run` takes. Unreadable images raise Error when they are asked for.")
      .def("__len__", &Sequence::size)
      .def("__getitem__", &Sequence::frame, nb::arg("index"))
      .def("__iter__", [](nb::object self) { return FrameIterator{std::move(self)}; })
      .def_prop_ro("camera", &Sequence::camera)
      .def("__repr__", [](const Sequence& s) {
        const api::CameraModel camera = s.camera();
        return text("Sequence({} frames of {} x {} pixels)", s.size(), camera.width, camera.height);
      });
}

}  // namespace ygslam::python
