// The things that a map says stand about, judged against the true ones.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

namespace ygslam {

/// Stands upright in the frame of the truth, whose z points up.
struct UprightBox {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  ///< along its own axes
  double yaw_rad = 0;                                ///< of its x axis about z
};

/// Intersection over union of the volumes, 0 to 1; 0 where one has none.
[[nodiscard]] double box_iou(const UprightBox& a, const UprightBox& b);

struct TrueObject {
  std::string class_name;
  UprightBox box;
  int frames = 0;         ///< that showed it there
  bool is_group = false;  ///< several things of its class that touch: each may be found, none must
};

struct FoundObject {
  std::string class_name;
  UprightBox box;
};

struct ObjectScoreOptions {
  double min_iou = 0.25;  ///< of boxes that belong together
  int min_frames = 15;    ///< a true object that fewer showed may be found, but need not
};

struct ObjectScore {
  ObjectScoreOptions options;
  int truths = 0;             ///< that must be found
  int found = 0;              ///< objects that count: without those that need not be found
  int matched = 0;            ///< pairs of both, whatever they are called
  int right_class = 0;        ///< of the pairs
  int duplicates = 0;         ///< of `found`: what a matched object shows already
  double centre_error_m = 0;  ///< mean over the pairs
  double size_error = 0;      ///< mean over pairs and axes of |found - true| / true

  [[nodiscard]] double precision() const;  ///< matched / found; 0 where nothing was found
  [[nodiscard]] double recall() const;     ///< matched / truths; 0 where there is nothing
  [[nodiscard]] double f1() const;
  [[nodiscard]] double f1_of_class() const;  ///< the same of pairs of one class
};

/// Pairs of greatest total overlap; of boxes that overlap alike those of one class.
[[nodiscard]] ObjectScore score_objects(std::span<const FoundObject> found,
                                        std::span<const TrueObject> truth,
                                        const ObjectScoreOptions& options = {});

[[nodiscard]] nlohmann::json to_json(const ObjectScore& score);
[[nodiscard]] std::string format_objects(const ObjectScore& score);

}  // namespace ygslam
