#include "tracking/camera_estimator.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <span>
#include <unordered_map>

#include "core/statistics.hpp"
#include "geometry/small_systems.hpp"
#include "image/depth.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kFewestParts = 6;
constexpr std::size_t kMostParts = 64;
constexpr int kKeyframes = 2;           // of the view each frame is compared with
constexpr double kLively_radps = 0.15;  // a camera that turns slower tells next to nothing
constexpr int kFewestPoints = 60;       // that a pair has in common
constexpr int kRounds = 4;              // of the robust kernel
constexpr double kLeastScale = 0.7;
constexpr double kOctaveFactor = 1.2;  // of a corner's uncertainty
constexpr double kDepthSigmas = 3.0;   // corners sit on edges and slopes
constexpr double kLeastDepth_m = 0.1;
constexpr double kDamping = 1e-9;

// Of a residual's scale: what does not average out. Rendered worlds whose images are taken at once
// gave read-outs and delays (through depth alone) off by up to half of what these allow.
constexpr double kSystematic = 0.008, kSystematicDelay = 0.03;

constexpr int kMostColumns = 6 + 7;
// No memory is asked for.
using Mat3X = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMostColumns>;
using MatXX = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostColumns,
                            kMostColumns>;
using VecX = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostColumns, 1>;

/// One column after the other, as products here are lazy: Eigen's kernels for large matrices would
/// take seconds to compile and gain nothing.
template <typename Solver>
MatXX solve_columns(const Solver& solver, const MatXX& b) {
  MatXX x(b.rows(), b.cols());
  for (Eigen::Index i = 0; i < b.cols(); ++i) x.col(i) = solver.solve(VecX(b.col(i)));
  return x;
}

/// A point of a frame and what the parameters do to it.
struct MovingPoint {
  Vec3 p;       // in the camera at the middle instant
  Mat3X shift;  // of p by each parameter
};

/// A pixel's two residuals and its depth's, linear in the camera's motion and the parameters.
struct Rows {
  Mat3X J;
  Vec3 r;
  Vec3 sigma;
};

Eigen::Matrix<double, 2, 3> projection_jacobian(const Camera& camera, const Vec3& p) {
  const double iz = 1 / p.z();
  Eigen::Matrix<double, 2, 3> J;
  J << camera.fx() * iz, 0, -camera.fx() * p.x() * iz * iz, 0, camera.fy() * iz,
      -camera.fy() * p.y() * iz * iz;
  return J;
}

/// Whose depth a point has. One image's noise would make every effect of depth look smaller than it
/// is; the map's is an average.
enum class DepthSource : std::uint8_t { kMap, kSensor };

MovingPoint moving_point(const Camera& camera, const Feature& feature, double depth_m,
                         DepthSource source, const Vec6& body_velocity,
                         const std::vector<CameraParameter>& parameters) {
  MovingPoint point{camera.unproject(feature.ideal_px.cast<double>(), depth_m), {}};
  const Vec3& p = point.p;
  const double share = (feature.uv_px.y() + 0.5) / camera.height() - 0.5;
  const Vec3 to_middle = body_velocity.head<3>() + body_velocity.tail<3>().cross(p);  // per second
  // How the depth read at the feature's pixel changes while the camera moves on.
  const Vec2 flow_pxps = projection_jacobian(camera, p) * -to_middle;
  const double rate_mps = -to_middle.z() - feature.depth_slope.cast<double>().dot(flow_pxps);
  const bool measured = source == DepthSource::kSensor;
  const Vec3 by_depth_time = measured ? Vec3(-rate_mps * p / p.z()) : Vec3(Vec3::Zero());
  point.shift.resize(3, std::ssize(parameters));
  for (Eigen::Index i = 0; i < point.shift.cols(); ++i) {
    auto shift = point.shift.col(i);
    switch (parameters[static_cast<std::size_t>(i)]) {
      case CameraParameter::kReadout:
        shift = share * to_middle;
        break;
      case CameraParameter::kColourReadout:
        shift = share * (to_middle - by_depth_time);
        break;
      case CameraParameter::kDepthReadout:
        shift = share * by_depth_time;
        break;
      case CameraParameter::kDepthDelay:
        shift = by_depth_time;
        break;
      case CameraParameter::kFocalLength:
        shift = Vec3(-p.x(), -p.y(), 0);
        break;
      case CameraParameter::kCentreX:
        shift = Vec3(-p.z() / camera.fx(), 0, 0);
        break;
      case CameraParameter::kCentreY:
        shift = Vec3(0, -p.z() / camera.fy(), 0);
        break;
      case CameraParameter::kDepthBias:
        shift = measured ? Vec3(p.z() * p) : Vec3(Vec3::Zero());
        break;
    }
  }
  return point;
}

/// How a parameter shifts where a point of known place is projected to.
Vec2 projection_shift(const Camera& camera, const Vec3& p, CameraParameter parameter) {
  switch (parameter) {
    case CameraParameter::kFocalLength:
      return camera.project(p) - Vec2(camera.cx(), camera.cy());
    case CameraParameter::kCentreX:
      return Vec2::UnitX();
    case CameraParameter::kCentreY:
      return Vec2::UnitY();
    default:
      return Vec2::Zero();
  }
}

/// What a frame's features were corrected with already.
Eigen::VectorXd in_use(const ShutterTimes& times, const std::vector<CameraParameter>& parameters) {
  Eigen::VectorXd value = Eigen::VectorXd::Zero(std::ssize(parameters));
  for (Eigen::Index i = 0; i < value.size(); ++i) {
    const CameraParameter parameter = parameters[static_cast<std::size_t>(i)];
    if (parameter == CameraParameter::kReadout || parameter == CameraParameter::kColourReadout)
      value[i] = times.colour_readout_s;
    if (parameter == CameraParameter::kDepthReadout) value[i] = times.depth_readout_s;
    if (parameter == CameraParameter::kDepthDelay) value[i] = times.depth_delay_s;
  }
  return value;
}
/// Without what the stamps of its images tell.
Eigen::VectorXd in_use(const TrackedFrame& frame, const std::vector<CameraParameter>& parameters) {
  ShutterTimes times = frame.seen.read_out.times;
  if (!times.is_global()) times.depth_delay_s -= frame.seen.frame->depth_delay_s;
  return in_use(times, parameters);
}

Rows rows_of(const Camera& camera, const SE3& T_here_there, const MovingPoint& there,
             const Eigen::VectorXd& there_in_use, const MovingPoint& here,
             const Eigen::VectorXd& here_in_use, const Feature& here_feature,
             const std::vector<CameraParameter>& parameters) {
  const Vec3 p = T_here_there * there.p;
  const auto J_project = projection_jacobian(camera, p);
  Rows rows;
  rows.J.resize(3, 6 + there.shift.cols());
  rows.J.leftCols<3>() << J_project, Vec3::UnitZ().transpose();
  rows.J.middleCols<3>(3) = -rows.J.leftCols<3>() * skew(p);
  rows.r << camera.project(p) - here_feature.ideal_px.cast<double>(), p.z() - here.p.z();
  Mat3X by_there(3, there.shift.cols());
  Mat3X by_here(3, there.shift.cols());
  for (Eigen::Index i = 0; i < there.shift.cols(); ++i) {
    const Vec3 moved = T_here_there.R() * there.shift.col(i);
    by_there.col(i) << J_project * moved, moved.z();
    const CameraParameter parameter = parameters[static_cast<std::size_t>(i)];
    const Vec3 shift = here.shift.col(i);
    // A pixel is shifted by its row's time alone; intrinsics show in the projection instead.
    const bool by_time =
        parameter == CameraParameter::kReadout || parameter == CameraParameter::kColourReadout;
    const Vec2 pixel_shift = by_time ? Vec2(projection_jacobian(camera, here.p) * shift)
                                     : Vec2(-projection_shift(camera, p, parameter));
    by_here.col(i) << pixel_shift, shift.z();
  }
  rows.J.rightCols(there.shift.cols()) = by_there - by_here;
  rows.r -= by_there * there_in_use - by_here * here_in_use;
  const double sigma_px = std::pow(kOctaveFactor, here_feature.octave);
  rows.sigma << sigma_px, sigma_px, kDepthSigmas * kinect_depth_sigma_m(p.z());
  return rows;
}

/// Normal equations in x, with Geman-McClure weights by the spread of the residuals at x.
void add_up(std::span<const Rows> points, const VecX& x, MatXX& H, VecX& b) {
  std::vector<double> size_px(points.size());
  std::vector<double> size_depth(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Rows& rows = points[i];
    const Vec3 r = rows.r + rows.J * x;
    size_px[i] = r.head<2>().norm() / rows.sigma.x();
    size_depth[i] = rows.sigma.z() > 0 ? std::abs(r.z()) / rows.sigma.z() : 0;
  }
  const auto scale_of = [](std::vector<double> size) {
    return std::max(kLeastScale, 1.5 * median(size));
  };
  const double scale_px = scale_of(size_px);
  const double scale_depth = scale_of(size_depth);
  const auto weight_of = [](double size, double scale, double sigma) {
    const double root = 1 / ((1 + size * size / (scale * scale)) * sigma * scale);
    return root * root;
  };
  H.setZero();
  b.setZero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Rows& rows = points[i];
    const double w_px = weight_of(size_px[i], scale_px, rows.sigma.x());
    Vec3 weight(w_px, w_px, 0);
    if (rows.sigma.z() > 0) weight.z() = weight_of(size_depth[i], scale_depth, rows.sigma.z());
    const Mat3X weighted = weight.asDiagonal() * rows.J;
    H += rows.J.transpose().lazyProduct(weighted);
    b -= weighted.transpose().lazyProduct(rows.r);
  }
  H.diagonal().array() += kDamping;
}

/// Rows of the landmarks that a frame and a keyframe both see.
std::vector<Rows> rows_of_pair(const Camera& camera, const TrackedFrame& frame,
                               const ViewKeyframe& keyframe,
                               const std::vector<CameraParameter>& parameters) {
  const LocalView& view = *frame.view;
  std::unordered_map<std::int32_t, std::uint32_t> seen_here;  // landmark to feature
  for (std::uint32_t i = 0; i < frame.landmarks.size(); ++i)
    if (const std::int32_t k = view.find(frame.landmarks[i]); k >= 0) seen_here.emplace(k, i);
  const SE3 T_here_there = frame.T_camera_world * keyframe.T_camera_world.inverse();
  const ReadOut& read_out_there = keyframe.data->read_out;
  const Eigen::VectorXd here_in_use = in_use(frame, parameters);
  const Eigen::VectorXd there_in_use = in_use(read_out_there.times, parameters);
  std::vector<Rows> points;
  for (std::uint32_t j = 0; j < keyframe.landmarks.size(); ++j) {
    if (keyframe.landmarks[j] < 0) continue;
    const auto it = seen_here.find(keyframe.landmarks[j]);
    if (it == seen_here.end()) continue;
    const Feature& f_there = keyframe.data->features->points[j];
    const Feature& f_here = frame.seen.features->points[it->second];
    if (!(f_there.depth_m > 0) || f_there.on_depth_edge || f_here.on_depth_edge) continue;
    const ViewLandmark& landmark = view.landmarks[static_cast<std::size_t>(keyframe.landmarks[j])];
    const double mapped_m = (keyframe.T_camera_world * landmark.p_world).z();
    if (mapped_m < kLeastDepth_m) continue;
    const MovingPoint there = moving_point(camera, f_there, mapped_m, DepthSource::kMap,
                                           read_out_there.body_velocity, parameters);
    const double predicted_m = (T_here_there * there.p).z();
    if (predicted_m < kLeastDepth_m) continue;
    const bool has_depth = f_here.depth_m > 0;
    const MovingPoint here =
        moving_point(camera, f_here, has_depth ? f_here.depth_m : predicted_m, DepthSource::kSensor,
                     frame.seen.read_out.body_velocity, parameters);
    points.push_back(
        rows_of(camera, T_here_there, there, there_in_use, here, here_in_use, f_here, parameters));
    if (!has_depth) points.back().sigma.z() = 0;
  }
  return points;
}

}  // namespace

void CameraEstimator::Part::operator+=(const Part& other) {
  if (other.empty()) return;
  if (empty()) {
    *this = other;
    return;
  }
  H += other.H;
  g += other.g;
  residuals += other.residuals;
}

std::optional<CameraEstimator::Part> CameraEstimator::compare(const TrackedFrame& frame,
                                                              const ViewKeyframe& keyframe) const {
  const auto points = rows_of_pair(camera_, frame, keyframe, parameters_);
  if (std::ssize(points) < kFewestPoints) return std::nullopt;
  const auto n = std::ssize(parameters_);
  VecX x = VecX::Zero(6 + n);
  x.tail(n) = in_use(frame, parameters_);
  MatXX H(6 + n, 6 + n);
  VecX b(6 + n);
  for (int round = 0; round < kRounds; ++round) {
    add_up(points, x, H, b);
    x = H.ldlt().solve(b);
    if (!x.allFinite()) return std::nullopt;
  }
  const MatXX solved =
      solve_columns(SymmetricSystem6(H.topLeftCorner<6, 6>()), H.topRightCorner(6, n));
  Part part{H.bottomRightCorner(n, n) - H.bottomLeftCorner(n, 6).lazyProduct(solved),
            b.tail(n) - solved.transpose() * b.head(6), 3.0 * static_cast<double>(points.size())};
  if (!part.H.allFinite() || !part.g.allFinite()) return std::nullopt;
  return part;
}

void CameraEstimator::add(const TrackedFrame& frame) {
  const Vec6& body_velocity = frame.seen.read_out.body_velocity;
  if (body_velocity.isZero(0)) return;  // not known
  const Timestamp stamp = frame.seen.frame->stamp;
  if (!part_began_) part_began_ = stamp;
  if (seconds_between(stamp, *part_began_) > part_s_) {
    close_part();
    part_began_ = stamp;
  }
  if (body_velocity.tail<3>().norm() < kLively_radps) return;
  if (skip_ = !skip_; skip_) return;
  int compared = 0;
  for (const ViewKeyframe& keyframe : frame.view->keyframes) {
    if (compared >= kKeyframes) break;
    if (keyframe.data->read_out.body_velocity.isZero(0)) continue;
    if (const auto part = compare(frame, keyframe)) {
      part_ += *part;
      ++compared;
    }
  }
}

void CameraEstimator::close_part() {
  if (!part_.empty()) parts_.push_back(std::move(part_));
  part_ = {};
  if (parts_.size() < kMostParts) return;
  for (std::size_t i = 0; i < kMostParts / 2; ++i) {
    Part both = std::move(parts_[2 * i]);
    both += parts_[2 * i + 1];
    parts_[i] = std::move(both);
  }
  parts_.resize(kMostParts / 2);
  part_s_ *= 2;
}

void CameraEstimator::clear() {
  part_began_.reset();
  part_ = {};
  parts_.clear();
}

std::optional<CameraEstimator::Estimate> CameraEstimator::estimate() const {
  if (parts_.size() < kFewestParts) return std::nullopt;
  Part all;
  for (const Part& part : parts_) all += part;
  const Eigen::LDLT<MatXX> solver(all.H);
  if (solver.info() != Eigen::Success || !solver.isPositive()) return std::nullopt;
  Estimate estimate;
  estimate.value = solver.solve(VecX(all.g));
  // The parts' gradients at the common value (sandwich estimator; White 1982).
  MatXX spread = MatXX::Zero(all.H.rows(), all.H.cols());
  for (const Part& part : parts_) {
    const Parameters miss = part.g - part.H * estimate.value;
    spread += miss * miss.transpose();
  }
  const auto n = static_cast<double>(parts_.size());
  const MatXX covariance =
      solve_columns(solver, solve_columns(solver, spread).transpose()) * (n / (n - 1));
  estimate.std = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  // Bound on the bias where every whitened residual is off by s: a row of H^-1 J^T W^(1/2) times
  // them is at most s sqrt(n (H^-1)_kk) (Cauchy-Schwarz).
  const MatXX inverse = solve_columns(solver, MatXX::Identity(all.H.rows(), all.H.cols()));
  estimate.systematic = (all.residuals * inverse.diagonal().cwiseMax(0)).cwiseSqrt();
  for (Eigen::Index i = 0; i < estimate.systematic.size(); ++i)
    estimate.systematic[i] *=
        parameters_[static_cast<std::size_t>(i)] == CameraParameter::kDepthDelay ? kSystematicDelay
                                                                                 : kSystematic;
  estimate.parts = static_cast<int>(parts_.size());
  if (!estimate.value.allFinite() || !estimate.std.allFinite() || !estimate.systematic.allFinite())
    return std::nullopt;
  return estimate;
}

}  // namespace ygslam
