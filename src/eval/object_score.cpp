#include "eval/object_score.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/assignment.hpp"

namespace ygslam {
namespace {

using Eigen::Vector2d;
using Polygon = std::vector<Vector2d>;

constexpr double kClassBonus = 1e-3;  // decides between boxes that overlap alike
constexpr double kDuplicateShare = 0.5;

/// Corners counter-clockwise.
Polygon ground_of(const UprightBox& box) {
  const Eigen::Rotation2Dd R(box.yaw_rad);
  Polygon corners;
  for (const auto& [x, y] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}})
    corners.push_back(box.centre_m.head<2>() +
                      R * Vector2d(x * box.size_m.x(), y * box.size_m.y()));
  return corners;
}

/// What of the polygon lies to the left of a to b (Sutherland, Hodgman 1974).
Polygon left_of(const Polygon& polygon, const Vector2d& a, const Vector2d& b) {
  const auto side = [&](const Vector2d& p) {
    return (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
  };
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& p = polygon[i];
    const Vector2d& next = polygon[(i + 1) % polygon.size()];
    const double of_p = side(p), of_next = side(next);
    if (of_p >= 0) kept.push_back(p);
    if ((of_p >= 0) != (of_next >= 0)) kept.push_back(p + of_p / (of_p - of_next) * (next - p));
  }
  return kept;
}

double area_of(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& p = polygon[i];
    const Vector2d& next = polygon[(i + 1) % polygon.size()];
    twice += p.x() * next.y() - p.y() * next.x();
  }
  return std::max(0.0, twice / 2);
}

double shared_volume(const UprightBox& a, const UprightBox& b) {
  const auto low = [](const UprightBox& box) { return box.centre_m.z() - box.size_m.z() / 2; };
  const auto high = [](const UprightBox& box) { return box.centre_m.z() + box.size_m.z() / 2; };
  const double height = std::min(high(a), high(b)) - std::max(low(a), low(b));
  if (height <= 0) return 0;
  Polygon shared = ground_of(a);
  const Polygon other = ground_of(b);
  for (std::size_t i = 0; i < other.size() && !shared.empty(); ++i)
    shared = left_of(shared, other[i], other[(i + 1) % other.size()]);
  return height * area_of(shared);
}

/// Sizes along the axes of the truth: which of a box's sides is its front does not matter.
double size_error(const UprightBox& found, const UprightBox& truth) {
  Eigen::Vector3d size = found.size_m;
  const double turn = std::remainder(found.yaw_rad - truth.yaw_rad, std::numbers::pi);
  if (std::abs(turn) > std::numbers::pi / 4) std::swap(size.x(), size.y());
  return ((size - truth.size_m).cwiseAbs().array() / truth.size_m.array()).mean();
}

double share(int part, int of) { return of > 0 ? static_cast<double>(part) / of : 0; }

bool is_duplicate(const FoundObject& found, const TrueObject& matched, double min_iou) {
  if (box_iou(found.box, matched.box) >= min_iou) return true;
  return found.class_name == matched.class_name &&
         shared_volume(found.box, matched.box) > kDuplicateShare * found.box.size_m.prod();
}

}  // namespace

double box_iou(const UprightBox& a, const UprightBox& b) {
  const double shared = shared_volume(a, b);
  const double either = a.size_m.prod() + b.size_m.prod() - shared;
  return either > 0 ? std::clamp(shared / either, 0.0, 1.0) : 0;
}

double ObjectScore::precision() const { return share(matched, found); }
double ObjectScore::recall() const { return share(matched, truths); }
double ObjectScore::f1() const { return share(2 * matched, found + truths); }
double ObjectScore::f1_of_class() const { return share(2 * right_class, found + truths); }

ObjectScore score_objects(std::span<const FoundObject> found, std::span<const TrueObject> truth,
                          const ObjectScoreOptions& options) {
  ObjectScore score;
  score.options = options;
  const auto must_be_found = [&](const TrueObject& t) {
    return !t.is_group && t.frames >= options.min_frames;
  };
  score.truths = static_cast<int>(std::count_if(truth.begin(), truth.end(), must_be_found));
  std::vector<int> truth_of(found.size(), -1);
  if (!found.empty() && !truth.empty()) {
    Eigen::MatrixXd cost = Eigen::MatrixXd::Zero(std::ssize(found), std::ssize(truth));
    for (std::size_t i = 0; i < found.size(); ++i) {
      for (std::size_t j = 0; j < truth.size(); ++j) {
        const double iou = box_iou(found[i].box, truth[j].box);
        if (iou < options.min_iou) continue;
        const double bonus = found[i].class_name == truth[j].class_name ? kClassBonus : 0;
        cost(static_cast<int>(i), static_cast<int>(j)) = -1 - iou - bonus;  // a pair more is best
      }
    }
    truth_of = assign(cost);
    for (std::size_t i = 0; i < found.size(); ++i)
      if (truth_of[i] >= 0 && cost(static_cast<int>(i), truth_of[i]) == 0) truth_of[i] = -1;
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (truth_of[i] >= 0) {
      const TrueObject& its = truth[static_cast<std::size_t>(truth_of[i])];
      if (!must_be_found(its)) continue;
      ++score.found;
      ++score.matched;
      if (its.class_name == found[i].class_name) ++score.right_class;
      score.centre_error_m += (found[i].box.centre_m - its.box.centre_m).norm();
      score.size_error += size_error(found[i].box, its.box);
      continue;
    }
    const bool is_of_group = std::any_of(truth.begin(), truth.end(), [&](const TrueObject& t) {
      return t.is_group && t.class_name == found[i].class_name &&
             shared_volume(found[i].box, t.box) > 0;
    });
    if (is_of_group) continue;
    ++score.found;
    for (const int j : truth_of) {
      if (j < 0 || !is_duplicate(found[i], truth[static_cast<std::size_t>(j)], options.min_iou))
        continue;
      ++score.duplicates;
      break;
    }
  }
  if (score.matched > 0) {
    score.centre_error_m /= score.matched;
    score.size_error /= score.matched;
  }
  return score;
}

nlohmann::json to_json(const ObjectScore& score) {
  return {{"truths", score.truths},
          {"found", score.found},
          {"matched", score.matched},
          {"min_iou", score.options.min_iou},
          {"min_frames", score.options.min_frames},
          {"precision", score.precision()},
          {"recall", score.recall()},
          {"f1", score.f1()},
          {"f1_of_class", score.f1_of_class()},
          {"duplicates", score.duplicates},
          {"right_class", share(score.right_class, score.matched)},
          {"centre_error_m", score.centre_error_m},
          {"size_error", score.size_error}};
}

std::string format_objects(const ObjectScore& score) {
  std::array<char, 512> text{};
  std::snprintf(text.data(), text.size(),
                "objects       %d found, %d of %d true ones (IoU %.2f, seen in %d frames)\n"
                "              precision %.2f %%, recall %.2f %%, F1 %.2f %%, of the right class "
                "%.2f %%\n"
                "              %d duplicates; centre %.1f cm, size %.0f %% off on average\n",
                score.found, score.matched, score.truths, score.options.min_iou,
                score.options.min_frames, 100 * score.precision(), 100 * score.recall(),
                100 * score.f1(), 100 * score.f1_of_class(), score.duplicates,
                100 * score.centre_error_m, 100 * score.size_error);
  return text.data();
}

}  // namespace ygslam
