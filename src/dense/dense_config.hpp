// Settings of the dense map.
#pragma once

#include "dense/ground_plan.hpp"
#include "dense/object_map.hpp"
#include "dense/space_changes.hpp"
#include "volume/mesher.hpp"
#include "volume/volume.hpp"

namespace ygslam {

struct DenseMapConfig {
  bool enabled = true;  ///< false: it stays empty
  VolumeConfig volume;
  ReadingConfig reading;
  ObjectMapConfig objects;  ///< its cells are as large as those of the volume's space
  SpaceChangesConfig changes;
  GroundPlanConfig plan;
  bool keeps_plan = false;  ///< DenseMap::plan(); every frame that is considered is scanned for it
  int margin_px = 6;  ///< this far around a mover nothing is taken: masks and depth have soft edges
  double interval_s = 0.5;  ///< without a view for so long, a frame is offered; 0: keyframes alone
  double min_new = 0.02;    ///< share of a frame's surface, less of which is not worth a view
  int spare_views = 2;      ///< beyond those that a surface needs: then a frame's is removed again,
  int object_views = 6;     ///< if each object that it shows has more than these
  double protected_s = 10;  ///< a frame stays so long after it was taken
  int most_near = 40;       ///< frames of one place, whatever they show
  int most_views = Volume::kMaxViews - 1;  ///< of all kinds: a keyframe beyond waits
  double near_m = 1.5;  ///< from which so little of what they see moved in the image [m]
};

}  // namespace ygslam
