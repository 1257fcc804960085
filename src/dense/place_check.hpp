// What a view says of a place where an object was seen: there it is, there is nothing, or it is
// hidden.
#pragma once

#include "dense/known_object.hpp"
#include "volume/prepared_view.hpp"

namespace ygslam {

struct PlaceCheckConfig {
  DepthNoise noise;
  double margin_sigmas = 3, margin_m = 0.02;  ///< a depth so far behind a point is beyond it
  double min_visible = 0.5;                   ///< share of the surface that must be seen at all
  double min_through = 0.6;                   ///< share of what is seen of it that is seen through
  double window_s = 5;       ///< within which what was seen of the parts is put together
  int min_observations = 2;  ///< in a row
};

/// Notes what the view sees of the object's surface, and finds it empty if that was so in several
/// views. A nearer depth says nothing, nor does a view of elsewhere: what is hidden stays.
/// @return whether it is absent since this view.
bool check_place(const DepthView& view, const SE3& T_world_camera, Timestamp stamp,
                 const PlaceCheckConfig& config, KnownObject& object);

/// Whether it would find the place empty, if that is news: of the greater part of the surface, or
/// of some of it before it was found so often enough.
[[nodiscard]] bool sees_through(const DepthView& view, const SE3& T_world_camera,
                                const PlaceCheckConfig& config, const KnownObject& object);

}  // namespace ygslam
