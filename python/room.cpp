// The static room while it is mapped.
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "calls.hpp"
#include "text.hpp"

namespace nb = nanobind;

namespace ygslam::python {
namespace {

using Point = std::array<double, 3>;
using Cells = nb::ndarray<nb::numpy, const std::int8_t, nb::ndim<2>, nb::c_contig>;
using Triangles = Rows<const std::uint32_t, 3>;

void bind_parts(nb::module_& m) {
  nb::enum_<api::Space>(m, "Space", "What is known of a place.")
      .value("UNKNOWN", api::Space::kUnknown)
      .value("FREE", api::Space::kFree)
      .value("OCCUPIED", api::Space::kOccupied);
  nb::class_<api::RayHit>(m, "RayHit", "What is in a ray's way.")
      .def_ro("what", &api::RayHit::what, "FREE: nothing")
      .def_ro("distance_m", &api::RayHit::distance_m, "to it, else the whole length")
      .def("__repr__", [](const api::RayHit& hit) {
        return text("RayHit({} at {:.2f} m)", nb::cast(hit.what).attr("name"), hit.distance_m);
      });
  nb::class_<api::StaticObject>(m, "StaticObject", "An object that stands in the room.")
      .def_ro("id", &api::StaticObject::id)
      .def_ro("class_name", &api::StaticObject::class_name, "COCO's, or \"unknown\"")
      .def_ro("probability", &api::StaticObject::probability, "of the class")
      .def_ro("state", &api::StaticObject::state,
              "candidate, static, moving, settled, absent or unobserved")
      .def_prop_ro(
          "T_world_box", [](const api::StaticObject& t) { return to_matrix(t.T_world_box); },
          nb::rv_policy::automatic, "(4, 4): the middle of its box, whose z axis is up")
      .def_ro("size_m", &api::StaticObject::size_m, "along the axes of the box")
      .def_ro("views", &api::StaticObject::views, "keyframes that showed it")
      .def_ro("first_seen_ns", &api::StaticObject::first_seen_ns)
      .def_ro("last_seen_ns", &api::StaticObject::last_seen_ns)
      .def("__repr__", [](const api::StaticObject& t) {
        const auto& c = t.T_world_box.translation_m;
        return text("StaticObject({} {}, {}, at [{:.2f}, {:.2f}, {:.2f}] m)", t.class_name, t.id,
                    t.state, c[0], c[1], c[2]);
      });
  nb::class_<api::OccupancyGrid>(m, "OccupancyGrid",
                                 "A ground plan in the floor's frame, as nav_msgs/OccupancyGrid.")
      .def_prop_ro(
          "cells",
          [](const api::OccupancyGrid& g) {
            return Cells(g.cells.data(),
                         {static_cast<std::size_t>(g.height), static_cast<std::size_t>(g.width)},
                         nb::find(g));
          },
          nb::rv_policy::automatic,
          "(H, W) int8, row 0 has the smallest y: -1 unknown, 0 free, 100 occupied")
      .def_ro("resolution_m", &api::OccupancyGrid::resolution_m)
      .def_ro("t_ns", &api::OccupancyGrid::t_ns, "newest image in it; 0 = none")
      .def_ro("origin_m", &api::OccupancyGrid::origin_m, "x, y: lower left corner of cells[0, 0]")
      .def_prop_ro(
          "T_world_floor", [](const api::OccupancyGrid& g) { return to_matrix(g.T_world_floor); },
          nb::rv_policy::automatic, "(4, 4): z is up, the floor at 0")
      .def("__repr__", [](const api::OccupancyGrid& g) {
        return text("OccupancyGrid({} x {} cells of {:g} m)", g.height, g.width, g.resolution_m);
      });
}

}  // namespace

void bind_room(nb::module_& m) {
  bind_parts(m);
  nb::class_<api::Room>(m, "Room",
                        "The static room as it was at one time, people left out; nothing changes "
                        "it any more. Points are in the world [m]; arrays are views, to be read.")
      .def_prop_ro("t_ns", &api::Room::t_ns, "of the newest image in it; 0 = none")
      .def_prop_ro(
          "vertices", [](const api::Room& r) { return points_of(r.mesh().vertices, nb::find(r)); },
          nb::rv_policy::automatic, "of the mesh, (N, 3) float32 [m]")
      .def_prop_ro(
          "colors", [](const api::Room& r) { return colours_of(r.mesh().vertices, nb::find(r)); },
          nb::rv_policy::automatic, "of the vertices, (N, 3) uint8")
      .def_prop_ro(
          "normals",
          [](const api::Room& r) {
            const auto& list = r.mesh().normals;
            return columns_of<const float>(list, list.empty() ? nullptr : list.data()->data(),
                                           nb::find(r));
          },
          nb::rv_policy::automatic, "of the vertices, (N, 3) float32, unit length")
      .def_prop_ro(
          "triangles",
          [](const api::Room& r) -> Triangles {
            const auto& list = r.mesh().triangles;
            return columns_of<const std::uint32_t>(
                list, list.empty() ? nullptr : list.data()->data(), nb::find(r));
          },
          nb::rv_policy::automatic, "(M, 3) uint32: corners, counter-clockwise seen from outside")
      .def_prop_ro("objects", [](const api::Room& r) { return r.objects(); })
      .def_prop_ro("up", &api::Room::up_world, "in the world, unit length")
      .def_prop_ro("floor_m", &api::Room::floor_m, "height of the floor along it")
      .def_prop_ro(
          "T_world_floor", [](const api::Room& r) { return to_matrix(r.T_world_floor()); },
          nb::rv_policy::automatic, "(4, 4): z is up, the floor at 0")
      .def_prop_ro("cell_m", &api::Room::cell_m, "of at(), box() and ray()")
      .def(
          "occupancy",
          [](const api::Room& r, double min_m, double max_m) {
            const Unlocked unlocked;
            return r.occupancy(min_m, max_m);
          },
          nb::arg("min_m") = 0.10, nb::arg("max_m") = 1.50,
          "Occupied: something stands between these heights above the floor. Free: the floor or "
          "the air just above it was seen, and nothing stands there.")
      .def("at", &api::Room::at, nb::arg("point"))
      .def("box", &api::Room::box, nb::arg("min"), nb::arg("max"),
           "Occupied if anything in it is, else unknown if anything is.")
      .def("ray", &api::Room::ray, nb::arg("start"), nb::arg("direction"), nb::arg("max_m") = 10.0,
           nb::arg("past_unknown") = false,
           "To the first cell that is occupied or, unless past_unknown, unknown.")
      .def("__repr__", [](const api::Room& r) {
        return text("Room({} vertices, {} triangles, {} objects)", r.mesh().vertices.size(),
                    r.mesh().triangles.size(), r.objects().size());
      });
}

}  // namespace ygslam::python
