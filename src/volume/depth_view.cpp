#include "volume/depth_view.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/check.hpp"
#include "geometry/distortion.hpp"

namespace ygslam {
namespace {

constexpr int kColourRounds = 2;  // each shrinks the error by the skew per row, at most a twentieth
constexpr std::int32_t kNoSource = -1;

/// A recorded pixel.
struct Source {
  std::uint16_t u = 0, row = 0;
};

/// std::lround() of what is not negative, without a call.
template <typename T>
std::int32_t rounded(T value) {
  const auto whole = static_cast<std::int32_t>(value);
  return whole + (value - static_cast<T>(whole) >= T{0.5} ? 1 : 0);
}

std::uint16_t depth_units(float depth_m) {
  const float units = depth_m / static_cast<float>(DepthView::kUnit_m);
  return units >= 0.5F ? static_cast<std::uint16_t>(rounded(std::min(units, 65534.0F))) : 0;
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
  struct Motion {
    Eigen::Matrix3f R;
    Eigen::Vector3f t;
  };
  std::vector<Motion> of_row;

  template <typename TimeOf>
  RowMotions(int rows, const ReadOut& read_out, const TimeOf& time_of_s, double sign) {
    for (int v = 0; v < rows; ++v) {
      const SE3 motion = SE3::exp(sign * time_of_s(v) * read_out.body_velocity);
      of_row.push_back({motion.R().cast<float>(), motion.t().cast<float>()});
    }
  }
};

/// The points of a row of pixels and where they are seen: a list for each coordinate and loops
/// without branches for all that takes long, so that compilers take several pixels at once.
struct RowPoints {
  std::vector<float> x, y, z;
  std::vector<double> u_px, v_px;
  explicit RowPoints(int width) {
    for (auto* list : {&x, &y, &z}) list->resize(static_cast<std::size_t>(width));
    for (auto* list : {&u_px, &v_px}) list->resize(static_cast<std::size_t>(width));
  }

  /// Camera::project(), of points with z > 0.
  void project(const Camera& camera) {
    const double fx = camera.fx(), fy = camera.fy(), cx = camera.cx(), cy = camera.cy();
    const float *px = x.data(), *py = y.data(), *pz = z.data();
    double* __restrict u = u_px.data(), * __restrict v = v_px.data();
    const int width = camera.width();
    for (int i = 0; i < width; ++i) {
      const double inverse_z = 1.0 / static_cast<double>(pz[i]);
      u[i] = fx * px[i] * inverse_z + cx;
      v[i] = fy * py[i] * inverse_z + cy;
    }
  }
  /// Camera::distort().
  void distort(const CameraConfig& camera) {
    double* __restrict u = u_px.data(), * __restrict v = v_px.data();
    const Lens lens(camera);
    const int width = camera.width;
    for (int i = 0; i < width; ++i) {
      double distorted_u = u[i], distorted_v = v[i];
      distort_pixel(lens, distorted_u, distorted_v);
      u[i] = distorted_u, v[i] = distorted_v;
    }
  }
};

/// R p + t.
void move_point(const RowMotions::Motion& motion, float& x, float& y, float& z) {
  const auto row = [&](int i) {
    return motion.R(i, 0) * x + (motion.R(i, 1) * y + motion.R(i, 2) * z) + motion.t(i);
  };
  const float moved_x = row(0), moved_y = row(1), moved_z = row(2);
  x = moved_x, y = moved_y, z = moved_z;
}

/// Which recorded pixel each pixel of the ideal camera shows: the nearest that falls on it.
class DepthWarp {
 public:
  DepthWarp(const Camera& camera, const ReadOut& read_out, const RollingShutter& shutter)
      : camera_(camera),
        to_middle_(
            camera.height(), read_out, [&](int v) { return shutter.depth_time_s(v); },
            shutter.is_rolling() ? 1 : 0),
        points_(camera.width()) {}

  void add_row(int v, const float* depths_m, DepthView& view, Image<Source>& source) {
    place(v, depths_m);
    points_.project(camera_);
    const float* z = points_.z.data();
    const double *u_px = points_.u_px.data(), *v_px = points_.v_px.data();
    for (int u = 0; u < camera_.width(); ++u) {
      if (!(depths_m[u] > 0 && z[u] > 0)) continue;
      const double seen_u = u_px[u] + 0.5, seen_v = v_px[u] + 0.5;
      if (!(seen_u >= 0 && seen_v >= 0 && seen_u < camera_.width() && seen_v < camera_.height()))
        continue;
      const int to_u = static_cast<int>(seen_u), to_v = static_cast<int>(seen_v);
      const std::uint16_t depth = depth_units(z[u]);
      std::uint16_t& nearest = view.depth.at(to_u, to_v);
      if (depth == 0 || (nearest != 0 && nearest <= depth)) continue;
      nearest = depth;
      source.at(to_u, to_v) = {static_cast<std::uint16_t>(u), static_cast<std::uint16_t>(v)};
    }
  }

 private:
  /// The row's points, in the camera at the middle instant.
  void place(int v, const float* depths_m) {
    const double fx = camera_.fx(), fy = camera_.fy(), cx = camera_.cx(), cy = camera_.cy();
    const RowMotions::Motion motion = to_middle_.of_row[static_cast<std::size_t>(v)];
    double* __restrict u_px = points_.u_px.data(), * __restrict v_px = points_.v_px.data();
    for (int u = 0; u < camera_.width(); ++u) {
      const Vec2 ideal_px = camera_.undistort_pixel(u, v);
      u_px[u] = ideal_px.x(), v_px[u] = ideal_px.y();
    }
    float *__restrict x = points_.x.data(), *__restrict y = points_.y.data(),
                     *__restrict z = points_.z.data();
    const int width = camera_.width();
    for (int u = 0; u < width; ++u) {
      x[u] = static_cast<float>((u_px[u] - cx) / fx * depths_m[u]);
      y[u] = static_cast<float>((v_px[u] - cy) / fy * depths_m[u]);
      z[u] = depths_m[u];
    }
    for (int u = 0; u < width; ++u) move_point(motion, x[u], y[u], z[u]);
  }

  const Camera& camera_;
  RowMotions to_middle_;
  RowPoints points_;
};

/// Where the colour image shows what the depth image showed at another time.
class ColourFinder {
 public:
  ColourFinder(const Camera& camera, const ReadOut& read_out, const RollingShutter& shutter)
      : camera_(camera),
        from_middle_(
            camera.height(), read_out, [&](int v) { return shutter.colour_time_s(v); }, -1),
        points_(camera.width()),
        row_(points_.x.size()),
        found_(points_.x.size()) {
    for (int u = 0; u < camera.width(); ++u) column_x_.push_back((u - camera.cx()) / camera.fx());
  }

  /// Of each pixel of a row, with the row where the depth image showed it: at most a few rows off.
  /// @return of pixels with depth offsets of the recorded pixels, kNoSource outside the image.
  const std::int32_t* find(int v, const DepthView& view, const Source* source) {
    for (std::size_t u = 0; u < row_.size(); ++u) row_[u] = source[u].row;
    for (int round = 0; round < kColourRounds; ++round) {
      place(v, view.depth.row(v));
      points_.project(camera_);
      if (camera_.config().is_distorted()) points_.distort(camera_.config());
      note_rows();
    }
    return found_.data();
  }

 private:
  /// The points, in the camera as it was when the row was read.
  void place(int v, const std::uint16_t* depth) {
    const double row_y = (v - camera_.cy()) / camera_.fy();
    float *__restrict x = points_.x.data(), *__restrict y = points_.y.data(),
                     *__restrict z = points_.z.data();
    const double* column_x = column_x_.data();
    const int width = camera_.width();
    for (int u = 0; u < width; ++u) {
      const double depth_m = depth[u] * DepthView::kUnit_m;
      x[u] = static_cast<float>(column_x[u] * depth_m);
      y[u] = static_cast<float>(row_y * depth_m);
      z[u] = static_cast<float>(depth_m);
    }
    const std::int32_t* row = row_.data();
    const RowMotions::Motion* motions = from_middle_.of_row.data();
    for (int u = 0; u < width; ++u) move_point(motions[row[u]], x[u], y[u], z[u]);
  }

  /// In which row they are seen; who is not seen stays where he was, and is not seen again.
  void note_rows() {
    const int width = camera_.width();
    const double last_u = width - 1, last_v = camera_.height() - 1;
    const float* z = points_.z.data();
    const double *u_px = points_.u_px.data(), *v_px = points_.v_px.data();
    for (int i = 0; i < width; ++i) {
      const double u = u_px[i], v = v_px[i];
      found_[static_cast<std::size_t>(i)] = kNoSource;
      if (!(z[i] > 0 && u >= 0 && v >= 0 && u <= last_u && v <= last_v)) continue;
      const std::int32_t row = rounded(v);
      row_[static_cast<std::size_t>(i)] = row;
      found_[static_cast<std::size_t>(i)] = row * width + rounded(u);
    }
  }

  const Camera& camera_;
  RowMotions from_middle_;
  RowPoints points_;
  std::vector<double> column_x_;
  std::vector<std::int32_t> row_, found_;
};

/// Depth as the ideal camera sees it at the middle instant.
/// @return which recorded pixel each pixel shows; empty: each its own.
Image<Source> take_depth(const RecordedImages& images, const Camera& camera,
                         const ReadOut& read_out, const RollingShutter& shutter, DepthView& view) {
  if (!shutter.is_rolling() && !camera.config().is_distorted()) {
    std::transform(images.depth_m.begin(), images.depth_m.end(), view.depth.begin(), depth_units);
    return {};
  }
  Image<Source> source(camera.width(), camera.height());
  DepthWarp warp(camera, read_out, shutter);
  for (int v = 0; v < camera.height(); ++v) warp.add_row(v, images.depth_m.row(v), view, source);
  return source;
}

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
  const Image<Source> source = take_depth(images, camera, read_out, shutter, view);
  std::optional<ColourFinder> finder;
  if (shutter.depth_has_own_time()) finder.emplace(camera, read_out, shutter);

  ObjectNumbers number(view);
  for (int v = 0; v < height; ++v) {
    const std::int32_t* found = finder ? finder->find(v, view, source.row(v)) : nullptr;
    const std::uint16_t* depth = view.depth.row(v);
    for (int u = 0; u < width; ++u) {
      if (depth[u] == 0) continue;
      std::int32_t from = v * width + u;
      if (found != nullptr)
        from = found[u];
      else if (!source.empty())
        from = source.at(u, v).row * width + source.at(u, v).u;
      if (from == kNoSource) {  // nobody knows what it is: it only carves
        view.object.at(u, v) = DepthView::kExcluded;
        continue;
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
