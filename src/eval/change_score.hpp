// Whether a map followed what was moved: old places free, new ones known, nothing lost that stayed.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/time.hpp"
#include "eval/object_score.hpp"

namespace ygslam {

struct TimeSpan {
  Timestamp from, until;
};

/// A time at which a thing stood still.
struct TruePlace {
  UprightBox box;
  Timestamp from, until;
  int frames = 0;  ///< that showed it there
  /// When it could be seen there, and its empty place after it had left; nothing: not told.
  std::optional<std::vector<TimeSpan>> shown = {}, shown_empty = {};
};

struct TrueThing {
  std::string class_name;
  bool is_group = false;
  std::vector<TruePlace> places;  ///< in the order of time
};

/// Those that stand still at the end.
[[nodiscard]] std::vector<TrueObject> standing_at_end(std::span<const TrueThing> things);

/// The boxes of those that came to where they stand at the end.
[[nodiscard]] std::vector<UprightBox> moved_and_standing(std::span<const TrueThing> things);

/// The boxes of places that things left and that could not be seen since, as far as that is told.
[[nodiscard]] std::vector<UprightBox> left_unseen(std::span<const TrueThing> things);

/// The points that lie in none of the boxes, nor so near.
[[nodiscard]] std::vector<Eigen::Vector3f> apart_from(std::span<const Eigen::Vector3f> points,
                                                      std::span<const UprightBox> boxes,
                                                      double margin_m);

struct MappedPlace {
  UprightBox box;
  std::optional<Timestamp> known;        ///< when it was sure that the thing stands there
  std::optional<Timestamp> found_empty;  ///< when it was sure that it is gone
};

/// A thing of the map with all its places; the last is empty where it is absent.
struct MappedThing {
  std::string class_name;
  std::vector<MappedPlace> places;  ///< not empty
};

/// Of things that are no group, at places where enough frames showed them.
struct ChangeScore {
  int left = 0;         ///< places that a thing left
  int freed = 0;        ///< of them, where no object stands any more
  int taken = 0;        ///< places that a thing came to and stands at in the end
  int known = 0;        ///< of them, where an object stands
  int same_number = 0;  ///< of those, where the object has been at the thing's earlier place
  int stayed = 0;       ///< places that a thing never left
  int lost = 0;         ///< of them, where an object was called absent and none stands
  std::vector<double> freed_after_s, known_after_s;  ///< since it left, since it came
  /// Of these times those in which that could be seen, where the truth tells.
  std::vector<double> freed_after_shown_s, known_after_shown_s;
};
[[nodiscard]] ChangeScore score_changes(std::span<const MappedThing> found,
                                        std::span<const TrueThing> truth,
                                        const ObjectScoreOptions& options = {});

[[nodiscard]] nlohmann::json to_json(const ChangeScore& score);
/// Nothing where nothing was moved or lost.
[[nodiscard]] std::string format_changes(const ChangeScore& score);

}  // namespace ygslam
