#include "volume/depth_view.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/check.hpp"

namespace ygslam {
namespace {

constexpr int kColourRounds = 2;  // each shrinks the error by the skew per row, at most a twentieth
constexpr std::int32_t kNoSource = -1;

std::uint16_t depth_units(float depth_m) {
  const float units = depth_m / static_cast<float>(DepthView::kUnit_m);
  if (!(units >= 0.5F)) return 0;
  return static_cast<std::uint16_t>(std::lround(std::min(units, 65534.0F)));
}

/// Numbers of the objects in the order of their first pixel.
class ObjectNumbers {
 public:
  explicit ObjectNumbers(DepthView& view) : view_(view) {}
  std::uint8_t operator()(SceneObjectId object) {
    if (object == kNoSceneObject) return DepthView::kNothing;
    if (object == kUnsureObject) return DepthView::kUnsure;
    if (object == last_) return last_number_;
    const auto next = static_cast<std::uint8_t>(view_.objects.size() + 1);
    const auto [it, is_new] = numbers_.emplace(object, next);
    if (is_new) {
      CHECK(view_.objects.size() + 1 < DepthView::kUnsure,
            "more objects in a view than it can number");
      view_.objects.push_back(object);
    }
    last_ = object;
    return last_number_ = it->second;
  }

 private:
  DepthView& view_;
  std::map<SceneObjectId, std::uint8_t> numbers_;
  SceneObjectId last_ = kNoSceneObject;
  std::uint8_t last_number_ = 0;
};

/// Takes points of a row's instant to the middle one, and back.
struct RowMotions {
  std::vector<Eigen::Matrix3f> R;
  std::vector<Eigen::Vector3f> t;

  template <typename TimeOf>
  RowMotions(int rows, const ReadOut& read_out, const TimeOf& time_of_s, double sign) {
    for (int v = 0; v < rows; ++v) {
      const SE3 motion = SE3::exp(sign * time_of_s(v) * read_out.body_velocity);
      R.emplace_back(motion.R().cast<float>());
      t.emplace_back(motion.t().cast<float>());
    }
  }
  [[nodiscard]] Eigen::Vector3f move(int row, const Eigen::Vector3f& p) const {
    return R[static_cast<std::size_t>(row)] * p + t[static_cast<std::size_t>(row)];
  }
};

/// Which recorded pixel each pixel of the ideal camera shows: the nearest that falls on it.
void warp_depth(const RecordedImages& images, const Camera& camera, const ReadOut& read_out,
                const RollingShutter& shutter, DepthView& view, Image<std::int32_t>& source) {
  const RowMotions to_middle(
      camera.height(), read_out, [&](int v) { return shutter.depth_time_s(v); },
      shutter.is_rolling() ? 1 : 0);
  const Pinhole& ideal = view.camera;
  for (int v = 0; v < ideal.height; ++v) {
    const float* depths_m = images.depth_m.row(v);
    for (int u = 0; u < ideal.width; ++u) {
      const float depth_m = depths_m[u];
      if (!(depth_m > 0)) continue;
      const Vec2 ideal_px = camera.undistort_pixel(u, v);
      const Eigen::Vector3f p_middle =
          to_middle.move(v, camera.unproject(ideal_px, depth_m).cast<float>());
      if (!(p_middle.z() > 0)) continue;
      const Vec2 seen_px = camera.project(p_middle.cast<double>()) + Vec2(0.5, 0.5);
      if (!(seen_px.x() >= 0 && seen_px.y() >= 0 && seen_px.x() < ideal.width &&
            seen_px.y() < ideal.height))
        continue;
      const int to_u = static_cast<int>(seen_px.x());
      const int to_v = static_cast<int>(seen_px.y());
      const std::uint16_t depth = depth_units(p_middle.z());
      std::uint16_t& nearest = view.depth.at(to_u, to_v);
      if (depth == 0 || (nearest != 0 && nearest <= depth)) continue;
      nearest = depth;
      source.at(to_u, to_v) = v * ideal.width + u;
    }
  }
}

/// Where the colour image shows what the depth image showed at another time.
class ColourFinder {
 public:
  ColourFinder(const Camera& camera, const ReadOut& read_out, const RollingShutter& shutter)
      : camera_(camera),
        from_middle_(
            camera.height(), read_out, [&](int v) { return shutter.colour_time_s(v); }, -1) {}

  /// @param row where the depth image showed the point: at most a few rows off.
  /// @return offset of the recorded pixel, or kNoSource outside the image.
  [[nodiscard]] std::int32_t find(const Vec3& p_middle, int row) const {
    Vec2 uv_px;
    for (int round = 0; round < kColourRounds; ++round) {
      const Vec3 p_cam = from_middle_.move(row, p_middle.cast<float>()).cast<double>();
      if (p_cam.z() <= 0) return kNoSource;
      uv_px = camera_.distort(camera_.project(p_cam));
      if (!camera_.contains(uv_px)) return kNoSource;
      const int before = std::exchange(
          row, std::clamp(static_cast<int>(std::lround(uv_px.y())), 0, camera_.height() - 1));
      if (row == before) break;
    }
    return static_cast<std::int32_t>(std::lround(uv_px.y())) * camera_.width() +
           static_cast<std::int32_t>(std::lround(uv_px.x()));
  }

 private:
  const Camera& camera_;
  RowMotions from_middle_;
};

}  // namespace

DepthView make_depth_view(const RecordedImages& images, const Camera& camera,
                          const ReadOut& read_out) {
  CHECK(images.depth_m.width() == camera.width() && images.depth_m.height() == camera.height());
  CHECK(images.colour.same_size(images.depth_m));
  CHECK(images.object.empty() || images.object.same_size(images.depth_m));
  CHECK(images.excluded.empty() || images.excluded.same_size(images.depth_m));
  DepthView view;
  view.camera = {camera.fx(), camera.fy(),    camera.cx(),
                 camera.cy(), camera.width(), camera.height()};
  const int width = camera.width();
  const int height = camera.height();
  view.depth = Image<std::uint16_t>(width, height);
  view.colour = ColourImage(width, height);
  view.object = Image<std::uint8_t>(width, height);

  const RollingShutter shutter(height, read_out);
  const bool as_recorded = !shutter.is_rolling() && !camera.config().is_distorted();
  Image<std::int32_t> source;
  if (as_recorded) {
    std::transform(images.depth_m.begin(), images.depth_m.end(), view.depth.begin(), depth_units);
  } else {
    source = Image<std::int32_t>(width, height, kNoSource);
    warp_depth(images, camera, read_out, shutter, view, source);
  }
  std::optional<ColourFinder> finder;
  if (shutter.depth_has_own_time()) finder.emplace(camera, read_out, shutter);

  ObjectNumbers number(view);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      if (view.depth.at(u, v) == 0) continue;
      std::int32_t from = as_recorded ? v * width + u : source.at(u, v);
      if (finder) {
        from = finder->find(camera.unproject({u, v}, view.depth.at(u, v) * DepthView::kUnit_m),
                            from / width);
        if (from == kNoSource) {  // nobody knows what it is: it only carves
          view.object.at(u, v) = DepthView::kExcluded;
          continue;
        }
      }
      view.colour.at(u, v) = images.colour.data()[from];
      const bool excluded = !images.excluded.empty() && images.excluded.data()[from] != 0;
      if (excluded)
        view.object.at(u, v) = DepthView::kExcluded;
      else if (!images.object.empty())
        view.object.at(u, v) = number(images.object.data()[from]);
    }
  }
  return view;
}

}  // namespace ygslam
