#include "tracking/free_space_check.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/trace.hpp"

namespace ygslam {
namespace {

constexpr double kMinDepth_m = 0.1;
constexpr int kFewWrong = 5;  // of this many points on the map one may seem a violation
constexpr double kNearShareOfWidth = 1.0 / 8;  // neighbours are nearer than this ...
constexpr float kSameDepthRatio = 0.05F;       // ... and differ less in depth

// What is too near for the sensor leaves a hole in its depth where a keyframe saw through.
constexpr float kTooNear_m = 0.45F;
constexpr float kHole_px = 6;            // nothing is measured so far around the point, ...
constexpr double kSensorMeasures = 0.7;  // ... but at this share of the points on the map

constexpr int kSupport = 4;   // a violation has so many others around it, at least ...
constexpr int kMajority = 2;  // ... and so many for each surface point around it

enum class PointState : std::uint8_t {
  kUnknown,    // no keyframe saw the place
  kSurface,    // a surface was seen there before
  kViolation,  // a keyframe saw through it
};

class FreeSpaceCheck {
 public:
  FreeSpaceCheck(const Camera& camera, const FrameFeatures& frame,
                 std::span<const LandmarkId> landmarks, std::span<const std::uint8_t> known,
                 const LocalView& view, const FreeSpaceConfig& config)
      : camera_(camera),
        features_(frame.features->points),
        grid_(frame.grid),
        static_weight_(frame.static_weight),
        landmarks_(landmarks),
        known_(known),
        all_keyframes_(view.keyframes),
        keyframes_(view.keyframes),
        config_(config),
        near_px_(static_cast<float>(kNearShareOfWidth * camera.width())),
        state_(features_.size(), PointState::kUnknown) {
    for (const Feature& f : features_) depth_m_.push_back(f.depth_m);
    find_holes(frame.frame->depth_m);
    keyframes_ = keyframes_.first(std::min(keyframes_.size(), std::size_t(config.keyframes)));
  }

  /// Judges every feature with depth, unless too many that stand on the map seem to violate free
  /// space.
  void ask_map(const SE3& T_camera_world) {
    const SE3 T_world_camera = T_camera_world.inverse();
    int on_map = 0;
    int wrong = 0;
    for (std::size_t i = 0; i < features_.size(); ++i) {
      const Feature& f = features_[i];
      if (depth_m_[i] <= 0) continue;
      const Vec3 p_camera = camera_.unproject(f.ideal_px.cast<double>(), depth_m_[i]);
      const bool in_hole = f.depth_m <= 0;
      state_[i] = judge(T_world_camera * p_camera, in_hole ? all_keyframes_ : keyframes_);
      if (in_hole) continue;
      if (landmarks_[i] == kNoLandmark) continue;
      const bool seems_wrong = state_[i] == PointState::kViolation;
      ++on_map;
      wrong += seems_wrong ? 1 : 0;
      state_[i] = seems_wrong ? PointState::kUnknown : PointState::kSurface;
    }
    if (on_map < config_.min_landmarks || kFewWrong * wrong > on_map)
      state_.assign(features_.size(), PointState::kUnknown);
  }

  void carry_over_known() {
    for (std::uint32_t i = 0; i < state_.size(); ++i) {
      if (is_known(i) && state_[i] == PointState::kUnknown && landmarks_[i] == kNoLandmark)
        state_[i] = PointState::kViolation;
    }
  }

  /// Lone violations among surface points are bad depths. From the others on violation spreads to
  /// neighbours that no keyframe saw, where most around them violate, too (region growing).
  void vote_of_neighbours() {
    if (std::find(state_.begin(), state_.end(), PointState::kViolation) == state_.end()) return;
    count_neighbours();
    std::vector<std::uint32_t> lone;
    std::vector<std::uint32_t> front;
    for (std::uint32_t i = 0; i < state_.size(); ++i)
      if (state_[i] == PointState::kViolation)
        (!is_open(i) || is_supported(i) ? front : lone).push_back(i);
    for (const std::uint32_t i : lone) set_state(i, PointState::kUnknown);
    while (!front.empty()) {
      const std::uint32_t from = front.back();
      front.pop_back();
      visit_near(from, [&](std::uint32_t k) {
        if (!is_open(k) || state_[k] == PointState::kViolation || !is_supported(k)) return;
        set_state(k, PointState::kViolation);
        front.push_back(k);
      });
    }
  }

  [[nodiscard]] std::vector<std::uint8_t> violations() const {
    std::vector<std::uint8_t> result(state_.size());
    for (std::uint32_t i = 0; i < result.size(); ++i)
      result[i] = state_[i] == PointState::kViolation && is_open(i) ? 1 : 0;
    return result;
  }

 private:
  /// Points in holes of the depth image get the depth at which there would be one, if the sensor
  /// measures elsewhere.
  void find_holes(const DepthImage& image_m) {
    int on_map = 0, measured = 0;
    for (std::size_t i = 0; i < features_.size(); ++i) {
      if (landmarks_[i] == kNoLandmark) continue;
      ++on_map;
      measured += features_[i].depth_m > 0 ? 1 : 0;
    }
    if (on_map < config_.min_landmarks || measured < kSensorMeasures * on_map) return;
    for (std::size_t i = 0; i < features_.size(); ++i)
      if (landmarks_[i] == kNoLandmark && features_[i].depth_m <= 0 &&
          is_hole(image_m, features_[i].uv_px))
        depth_m_[i] = kTooNear_m;
  }
  [[nodiscard]] static bool is_hole(const DepthImage& image_m, const Eigen::Vector2f& uv_px) {
    for (const float dv : {-kHole_px, 0.0F, kHole_px})
      for (const float du : {-kHole_px, 0.0F, kHole_px}) {
        const int u = static_cast<int>(uv_px.x() + du), v = static_cast<int>(uv_px.y() + dv);
        if (image_m.contains(u, v) && image_m.at(u, v) > 0) return false;
      }
    return true;
  }
  [[nodiscard]] PointState judge(const Vec3& p_world,
                                 std::span<const ViewKeyframe> keyframes) const {
    PointState state = PointState::kUnknown;
    for (const ViewKeyframe& keyframe : keyframes) {
      const Vec3 p = keyframe.T_camera_world * p_world;
      if (p.z() < kMinDepth_m) continue;
      const double seen_m = seen_around(keyframe, camera_.project(p));
      if (seen_m <= 0) continue;
      const double margin_m = config_.margin_m + config_.margin_ratio * seen_m;
      if (p.z() < seen_m - margin_m) {
        state = PointState::kViolation;
      } else if (p.z() < seen_m + margin_m) {
        return PointState::kSurface;
      }
    }
    return state;
  }

  /// 0 = nobody knows.
  [[nodiscard]] double seen_around(const ViewKeyframe& keyframe, const Vec2& ideal_px) const {
    if (!camera_.sees(ideal_px)) return 0;
    return keyframe.data->free_space.around_m(camera_.distort(ideal_px));
  }

  template <typename Visitor>
  void visit_near(std::uint32_t i, Visitor&& visitor) const {
    const Feature& f = features_[i];
    grid_.visit(f.ideal_px, near_px_, 0, 255, [&](std::uint32_t k) {
      const float depth_m = depth_m_[k];
      if (k != i && depth_m > 0 && std::abs(depth_m - depth_m_[i]) < kSameDepthRatio * depth_m_[i])
        visitor(k);
    });
  }

  /// True if it may be called a violation: a point excluded for another reason counts only as a
  /// neighbour.
  [[nodiscard]] bool is_open(std::uint32_t i) const {
    return state_[i] != PointState::kSurface && landmarks_[i] == kNoLandmark && depth_m_[i] > 0 &&
           (static_weight_[i] > 0 || is_known(i));
  }
  [[nodiscard]] bool is_known(std::uint32_t i) const { return i < known_.size() && known_[i] != 0; }

  void count_neighbours() {
    around_.assign(state_.size(), {});
    for (std::uint32_t i = 0; i < state_.size(); ++i) {
      if (!is_open(i)) continue;
      visit_near(i, [&](std::uint32_t k) {
        around_[i].violating += state_[k] == PointState::kViolation ? 1 : 0;
        around_[i].surface += state_[k] == PointState::kSurface ? 1 : 0;
      });
    }
  }

  /// From unknown to violation or back.
  void set_state(std::uint32_t i, PointState state) {
    state_[i] = state;
    const int change = state == PointState::kViolation ? 1 : -1;
    visit_near(i, [&](std::uint32_t k) { around_[k].violating += change; });
  }

  [[nodiscard]] bool is_supported(std::uint32_t i) const {
    return around_[i].violating >= kSupport &&
           around_[i].violating > kMajority * around_[i].surface;
  }

  struct Around {
    int violating = 0, surface = 0;
  };

  const Camera& camera_;
  const std::vector<Feature>& features_;
  const FeatureGrid& grid_;
  const std::vector<float>& static_weight_;
  std::span<const LandmarkId> landmarks_;
  std::span<const std::uint8_t> known_;
  std::span<const ViewKeyframe> all_keyframes_;
  std::span<const ViewKeyframe> keyframes_;  // those asked of points with depth
  const FreeSpaceConfig& config_;
  float near_px_;
  std::vector<float> depth_m_;  // per feature, of holes kTooNear_m
  std::vector<PointState> state_;
  std::vector<Around> around_;  // near each open feature, at its depth
};

}  // namespace

std::vector<std::uint8_t> find_free_space_violations(
    const Camera& camera, const FrameFeatures& frame, std::span<const LandmarkId> landmarks,
    std::span<const std::uint8_t> known, const LocalView& view, const SE3& T_camera_world,
    const FreeSpaceConfig& config) {
  FreeSpaceCheck check(camera, frame, landmarks, known, view, config);
  if (!config.enabled) return check.violations();
  check.ask_map(T_camera_world);
  check.carry_over_known();
  check.vote_of_neighbours();
  return check.violations();
}

ObservedFrame compared_with_map(ObservedFrame now, const PoseResult& pose, const LocalView& view,
                                const Camera& camera, const PointClassifier& classifier,
                                const FreeSpaceConfig& config) {
  const trace::Span span("free space");
  std::vector<std::uint8_t> known;
  for (const PointEvidence& point : now.evidence.points)
    known.push_back(point.in_free_space ? 1 : 0);
  const auto violations = find_free_space_violations(camera, now.seen, pose.landmarks, known, view,
                                                     pose.T_camera_world, config);
  now.evidence = with_free_space(std::move(now.evidence), violations);
  now.labels = promote(classifier.classify(now.evidence), pose.landmarks);
  now.seen.static_weight = now.labels.weight;
  return now;
}

}  // namespace ygslam
