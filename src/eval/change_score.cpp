#include "eval/change_score.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/statistics.hpp"

namespace ygslam {
namespace {

Timestamp end_of(std::span<const TrueThing> things) {
  Timestamp end;
  for (const TrueThing& thing : things)
    for (const TruePlace& place : thing.places) end.ns = std::max(end.ns, place.until.ns);
  return end;
}

/// The found things' places, as far as they belong to one of the truth.
class Places {
 public:
  Places(std::span<const MappedThing> found, double min_iou) : found_(found), min_iou_(min_iou) {}

  /// The thing that stands in the box; nothing: none does.
  [[nodiscard]] const MappedThing* standing_in(const UprightBox& box) const {
    const auto thing = std::find_if(found_.begin(), found_.end(), [&](const MappedThing& t) {
      return !t.places.back().found_empty && fits(t.places.back(), box);
    });
    return thing == found_.end() ? nullptr : &*thing;
  }
  /// When a place there was found empty first, after `since`.
  [[nodiscard]] std::optional<Timestamp> found_empty(const UprightBox& box, Timestamp since) const {
    std::optional<Timestamp> first;
    for (const MappedThing& thing : found_) {
      for (const MappedPlace& place : thing.places) {
        if (!place.found_empty || !fits(place, box) || *place.found_empty < since) continue;
        if (!first || *place.found_empty < *first) first = place.found_empty;
      }
    }
    return first;
  }
  [[nodiscard]] bool was_in(const MappedThing& thing, const UprightBox& box) const {
    return std::any_of(thing.places.begin(), thing.places.end() - 1,
                       [&](const MappedPlace& place) { return fits(place, box); });
  }

 private:
  [[nodiscard]] bool fits(const MappedPlace& place, const UprightBox& box) const {
    return box_iou(place.box, box) >= min_iou_;
  }

  std::span<const MappedThing> found_;
  double min_iou_;
};

/// @param shown of these times those in which that could be seen.
std::string times_text(std::vector<double> seconds, std::vector<double> shown) {
  if (seconds.empty()) return "";
  const auto worst = [](const std::vector<double>& s) {
    return *std::max_element(s.begin(), s.end());
  };
  std::array<char, 128> text{};
  if (shown.empty())
    std::snprintf(text.data(), text.size(), " after %.1f s (at most %.1f s)", median(seconds),
                  worst(seconds));
  else
    std::snprintf(
        text.data(), text.size(),
        " after %.1f s (at most %.1f s), of which it could be seen %.1f s (at most %.1f s)",
        median(seconds), worst(seconds), median(shown), worst(shown));
  return text.data();
}

void add_time(const std::optional<std::vector<TimeSpan>>& shown, Timestamp since, Timestamp noticed,
              std::vector<double>& seconds) {
  if (!shown) return;
  double sum_s = 0;
  for (const TimeSpan& span : *shown)
    sum_s +=
        std::max(0.0, seconds_between(std::min(span.until, noticed), std::max(span.from, since)));
  seconds.push_back(sum_s);
}

}  // namespace

std::vector<TrueObject> standing_at_end(std::span<const TrueThing> things) {
  const Timestamp end = end_of(things);
  std::vector<TrueObject> standing;
  for (const TrueThing& thing : things) {
    if (thing.places.empty() || thing.places.back().until != end) continue;
    const TruePlace& place = thing.places.back();
    standing.push_back({thing.class_name, place.box, place.frames, thing.is_group});
  }
  return standing;
}

std::vector<UprightBox> moved_and_standing(std::span<const TrueThing> things) {
  const Timestamp end = end_of(things);
  Timestamp begin = end;
  for (const TrueThing& thing : things)
    for (const TruePlace& place : thing.places) begin = std::min(begin, place.from);
  std::vector<UprightBox> boxes;
  for (const TrueThing& thing : things) {
    if (thing.places.empty()) continue;
    const TruePlace& last = thing.places.back();
    if (last.until == end && last.from > begin) boxes.push_back(last.box);
  }
  return boxes;
}

std::vector<UprightBox> left_unseen(std::span<const TrueThing> things) {
  const Timestamp end = end_of(things);
  std::vector<UprightBox> boxes;
  for (const TrueThing& thing : things)
    for (const TruePlace& place : thing.places)
      if (place.until != end && place.shown_empty && place.shown_empty->empty())
        boxes.push_back(place.box);
  return boxes;
}

std::vector<Eigen::Vector3f> apart_from(std::span<const Eigen::Vector3f> points,
                                        std::span<const UprightBox> boxes, double margin_m) {
  const auto is_in_one = [&](const Eigen::Vector3f& p) {
    return std::any_of(boxes.begin(), boxes.end(), [&](const UprightBox& box) {
      const Eigen::Vector3d q = Eigen::AngleAxisd(-box.yaw_rad, Eigen::Vector3d::UnitZ()) *
                                (p.cast<double>() - box.centre_m);
      return (q.array().abs() < box.size_m.array() / 2 + margin_m).all();
    });
  };
  std::vector<Eigen::Vector3f> apart;
  std::copy_if(points.begin(), points.end(), std::back_inserter(apart),
               [&](const Eigen::Vector3f& p) { return !is_in_one(p); });
  return apart;
}

ChangeScore score_changes(std::span<const MappedThing> found, std::span<const TrueThing> truth,
                          const ObjectScoreOptions& options) {
  const Places places(found, options.min_iou);
  const Timestamp end = end_of(truth);
  ChangeScore score;
  for (const TrueThing& thing : truth) {
    if (thing.is_group) continue;
    for (std::size_t i = 0; i < thing.places.size(); ++i) {
      const TruePlace& place = thing.places[i];
      if (place.frames < options.min_frames) continue;
      const MappedThing* standing = places.standing_in(place.box);
      if (place.until != end) {
        ++score.left;
        if (!standing) ++score.freed;
        if (const auto when = places.found_empty(place.box, place.until)) {
          score.freed_after_s.push_back(seconds_between(*when, place.until));
          add_time(place.shown_empty, place.until, *when, score.freed_after_shown_s);
        }
      } else if (i == 0) {
        ++score.stayed;
        if (!standing && places.found_empty(place.box, place.from)) ++score.lost;
      } else {
        ++score.taken;
        if (!standing) continue;
        ++score.known;
        if (const auto when = standing->places.back().known) {
          score.known_after_s.push_back(seconds_between(*when, place.from));
          add_time(place.shown, place.from, *when, score.known_after_shown_s);
        }
        if (places.was_in(*standing, thing.places[i - 1].box)) ++score.same_number;
      }
    }
  }
  return score;
}

nlohmann::json to_json(const ChangeScore& score) {
  return {{"left", score.left},
          {"freed", score.freed},
          {"freed_after_s", score.freed_after_s},
          {"freed_after_shown_s", score.freed_after_shown_s},
          {"taken", score.taken},
          {"known", score.known},
          {"known_after_s", score.known_after_s},
          {"known_after_shown_s", score.known_after_shown_s},
          {"same_number", score.same_number},
          {"stayed", score.stayed},
          {"lost", score.lost}};
}

std::string format_changes(const ChangeScore& score) {
  if (score.left + score.taken + score.lost == 0) return "";
  std::array<char, 1024> text{};
  std::snprintf(text.data(), text.size(),
                "changes       %d of %d left places free%s\n"
                "              %d of %d new places known%s, %d under the old number\n"
                "              %d of %d that stayed are lost\n",
                score.freed, score.left,
                times_text(score.freed_after_s, score.freed_after_shown_s).c_str(), score.known,
                score.taken, times_text(score.known_after_s, score.known_after_shown_s).c_str(),
                score.same_number, score.lost, score.stayed);
  return text.data();
}

}  // namespace ygslam
