#include "orb_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>

#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/rng.hpp"
#include "core/statistics.hpp"
#include "features/matcher.hpp"
#include "geometry/camera.hpp"
#include "image/cv_view.hpp"
#include "image/depth.hpp"
#include "texture.hpp"

namespace ygslam::bench {

namespace {

// Where a feature of the first image truly lies in the second; nullopt = not visible or not known.
using Truth = std::function<std::optional<Eigen::Vector2f>(const Feature&)>;

struct Score {
  double visible = 0, repeated = 0, matches = 0, correct = 0;
  double count = 0, pairs = 0;
  double spread = 0;              // occupied share of the cells of 40 x 40 px
  std::vector<double> errors_px;  // of correct matches

  void add(const Score& other) {
    visible += other.visible;
    repeated += other.repeated;
    matches += other.matches;
    correct += other.correct;
    count += other.count;
    pairs += other.pairs;
    spread += other.spread;
    errors_px.insert(errors_px.end(), other.errors_px.begin(), other.errors_px.end());
  }
};

// One to one: each feature of b answers at most once; scales must agree to one octave.
int count_repeated(const Features& b, const std::vector<std::pair<Feature, Eigen::Vector2f>>& seen,
                   double tolerance_px) {
  struct Pair {
    double d;
    std::size_t a, b;
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      const double d = (b.points[j].uv_px - seen[i].second).norm();
      if (d <= tolerance_px && std::abs(b.points[j].octave - seen[i].first.octave) <= 1) {
        pairs.push_back({d, i, j});
      }
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& x, const Pair& y) { return x.d < y.d; });
  std::vector<char> used_a(seen.size());
  std::vector<char> used_b(b.size());
  int repeated = 0;
  for (const Pair& p : pairs) {
    if (used_a[p.a] || used_b[p.b]) continue;
    used_a[p.a] = used_b[p.b] = 1;
    ++repeated;
  }
  return repeated;
}

double occupied_share(const Features& features) {
  constexpr int kCell_px = 40;
  std::set<std::pair<int, int>> cells;
  for (const Feature& f : features.points) {
    cells.emplace(static_cast<int>(f.uv_px.x()) / kCell_px,
                  static_cast<int>(f.uv_px.y()) / kCell_px);
  }
  return static_cast<double>(cells.size()) / (640.0 * 480.0 / (kCell_px * kCell_px));
}

Score score_pair(const Features& a, const Features& b, const Truth& truth, double tolerance_px) {
  Score score;
  score.pairs = 1;
  score.spread = occupied_share(a);
  score.count = 0.5 * static_cast<double>(a.size() + b.size());
  std::vector<std::pair<Feature, Eigen::Vector2f>> seen;
  std::vector<std::optional<Eigen::Vector2f>> truths;
  for (const Feature& f : a.points) {
    truths.push_back(truth(f));
    if (truths.back()) seen.emplace_back(f, *truths.back());
  }
  score.visible = static_cast<double>(seen.size());
  score.repeated = count_repeated(b, seen, tolerance_px);
  for (const Match& m : match_brute_force(a, b)) {
    if (!truths[m.a]) continue;
    ++score.matches;
    const double error_px = (b.points[m.b].uv_px - *truths[m.a]).norm();
    if (error_px > tolerance_px) continue;
    ++score.correct;
    score.errors_px.push_back(error_px);
  }
  return score;
}

void print_header() {
  std::printf("%-34s %-12s %6s %6s %8s %8s %9s %8s %8s %7s\n", "pairs", "extractor", "count",
              "pairs", "repeat", "matches", "correct", "precis.", "err[px]", "spread");
}

void print_row(const std::string& what, const std::string& who, Score& s) {
  const double median_px = s.errors_px.empty() ? 0 : median(s.errors_px);
  const double n = std::max(1.0, s.pairs);
  std::printf("%-34s %-12s %6.0f %6.0f %7.2f%% %8.1f %9.1f %7.2f%% %8.3f %6.1f%%\n", what.c_str(),
              who.c_str(), s.count / n, s.pairs, 100 * s.repeated / std::max(1.0, s.visible),
              s.matches / n, s.correct / n, 100 * s.correct / std::max(1.0, s.matches), median_px,
              100 * s.spread / n);
}

// Features of all candidates for one image, at equal count: the smallest any of them finds.
std::vector<Features> extract_equal(const std::vector<Candidate>& candidates,
                                    const GreyImage& image, int count) {
  std::vector<Features> found(candidates.size());
  std::vector<int> asked(candidates.size(), count + 1);
  for (int round = 0; round < 5; ++round) {
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (asked[i] == count || static_cast<int>(found[i].size()) == count) continue;
      asked[i] = count;
      found[i] = candidates[i].extract(image, count);
    }
    for (const Features& f : found) count = std::min(count, static_cast<int>(f.size()));
  }
  return found;
}

// ---------------------------------------------------------------- synthetic warps

void table_of_warps(const std::vector<Candidate>& candidates, const std::string& source,
                    const std::vector<GreyImage>& images, int count) {
  for (const std::string kind :
       {"translation", "rotation", "scale", "perspective", "light", "noise"}) {
    Rng rng(17);
    std::vector<Score> scores(candidates.size());
    for (const GreyImage& image : images) {
      const Warp warp = make_warp(kind, image.width(), image.height(), rng);
      const GreyImage warped = apply_warp(image, warp, rng);
      const auto a = extract_equal(candidates, image, count);
      const auto b = extract_equal(candidates, warped, count);
      const Truth truth = [&](const Feature& f) -> std::optional<Eigen::Vector2f> {
        const Eigen::Vector2d uv =
            (warp.H * f.uv_px.cast<double>().homogeneous()).eval().hnormalized();
        if (uv.x() < 20 || uv.y() < 20 || uv.x() > image.width() - 21 ||
            uv.y() > image.height() - 21) {
          return std::nullopt;
        }
        return uv.cast<float>();
      };
      for (std::size_t i = 0; i < candidates.size(); ++i) {
        scores[i].add(score_pair(a[i], b[i], truth, 3.0));
      }
    }
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      print_row(source + ", " + kind, candidates[i].name, scores[i]);
    }
  }
}

// ---------------------------------------------------------------- recorded sequences

struct Frame {
  double t_s = 0;
  std::string rgb, depth;
};

struct Sequence {
  CameraConfig camera;
  std::vector<Frame> frames;
  std::map<double, SE3> T_world_cam;
};

std::vector<std::vector<std::string>> read_table(const std::string& path) {
  std::vector<std::vector<std::string>> rows;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::vector<std::string> row;
    for (std::string word; words >> word;) row.push_back(word);
    if (!row.empty() && row[0][0] != '#') rows.push_back(row);
  }
  return rows;
}

Sequence read_sequence(const std::string& folder) {
  Sequence s;
  std::map<std::string, double*> keys = {
      {"fx", &s.camera.fx}, {"fy", &s.camera.fy},
      {"cx", &s.camera.cx}, {"cy", &s.camera.cy},
      {"k1", &s.camera.k1}, {"k2", &s.camera.k2},
      {"p1", &s.camera.p1}, {"p2", &s.camera.p2},
      {"k3", &s.camera.k3}, {"depth_scale", &s.camera.depth_scale}};
  for (const auto& row : read_table(folder + "/calibration.txt")) {
    if (row.size() >= 2 && keys.contains(row[0])) *keys[row[0]] = std::stod(row[1]);
  }
  for (const auto& row : read_table(folder + "/associations.txt")) {
    if (row.size() >= 4) {
      s.frames.push_back({std::stod(row[0]), folder + "/" + row[1], folder + "/" + row[3]});
    }
  }
  for (const auto& row : read_table(folder + "/groundtruth.txt")) {
    if (row.size() < 8) continue;
    std::vector<double> v;
    for (const auto& word : row) v.push_back(std::stod(word));
    s.T_world_cam[v[0]] = SE3(Eigen::Quaterniond(v[7], v[4], v[5], v[6]), Vec3(v[1], v[2], v[3]));
  }
  return s;
}

std::optional<SE3> pose_at(const Sequence& s, double t_s) {
  const auto after = s.T_world_cam.lower_bound(t_s);
  if (after == s.T_world_cam.end()) return std::nullopt;
  if (after->first == t_s) return after->second;
  if (after == s.T_world_cam.begin()) return std::nullopt;
  const auto before = std::prev(after);
  if (after->first - before->first > 0.1) return std::nullopt;
  const double w = (t_s - before->first) / (after->first - before->first);
  return before->second * SE3::exp(w * (before->second.inverse() * after->second).log());
}

GreyImage read_grey(const std::string& path) {
  const cv::Mat mat = cv::imread(path, cv::IMREAD_GRAYSCALE);
  GreyImage image(mat.cols, mat.rows);
  if (!mat.empty()) mat.copyTo(cv_view(image));
  return image;
}

DepthImage read_depth(const std::string& path, double scale) {
  const cv::Mat mat = cv::imread(path, cv::IMREAD_UNCHANGED);
  Image<std::uint16_t> raw(mat.cols, mat.rows);
  if (!mat.empty() && mat.type() == CV_16UC1) mat.copyTo(cv_view(raw));
  return depth_from_raw(raw, scale, {});
}

// The recorded poses are a few pixels off (clocks of camera and tracker differ). All candidates'
// matches together correct the pose between the two frames: Gauss-Newton on their reprojection
// errors, Tukey's weights, 12 px at first and 3 px at the end.
SE3 refine_truth(const Camera& camera, const DepthImage& depth_a, const std::vector<Features>& a,
                 const std::vector<Features>& b, SE3 T_b_a) {
  struct Observation {
    Vec3 p_a;
    Vec2 ideal_px;
  };
  std::vector<Observation> observations;
  for (std::size_t c = 0; c < a.size(); ++c) {
    for (const Match& m : match_brute_force(a[c], b[c])) {
      const Vec2 uv = a[c].points[m.a].uv_px.cast<double>();
      const float z = depth_at(depth_a, uv.x(), uv.y());
      if (z <= 0) continue;
      observations.push_back({camera.unproject(camera.undistort(uv), z),
                              camera.undistort(b[c].points[m.b].uv_px.cast<double>())});
    }
  }
  for (int iteration = 0; iteration < 15; ++iteration) {
    const double limit_px = std::max(3.0, 12.0 - iteration);
    Mat6 H = 1e-9 * Mat6::Identity();
    Vec6 g = Vec6::Zero();
    for (const Observation& o : observations) {
      const Vec3 p = T_b_a * o.p_a;
      if (p.z() < 0.1) continue;
      const Vec2 r = camera.project(p) - o.ideal_px;
      const double x = r.squaredNorm() / (limit_px * limit_px);
      if (x >= 1) continue;
      Eigen::Matrix<double, 2, 3> by_point;
      by_point << camera.fx() / p.z(), 0, -camera.fx() * p.x() / (p.z() * p.z()), 0,
          camera.fy() / p.z(), -camera.fy() * p.y() / (p.z() * p.z());
      Eigen::Matrix<double, 3, 6> by_twist;
      by_twist << Mat3::Identity(), -skew(p);
      const Eigen::Matrix<double, 2, 6> J = by_point * by_twist;
      const double weight = (1 - x) * (1 - x);
      H += weight * J.transpose() * J;
      g += weight * J.transpose() * r;
    }
    T_b_a = SE3::exp(-(H.ldlt().solve(g))) * T_b_a;
  }
  return T_b_a;
}

// By depth and poses; a point hidden in the second view (its depth disagrees) is not visible.
Truth truth_of_pair(const Camera& camera, const DepthImage& depth_a, const DepthImage& depth_b,
                    const SE3& T_b_a) {
  return [&, T_b_a](const Feature& f) -> std::optional<Eigen::Vector2f> {
    const float z = depth_at(depth_a, f.uv_px.x(), f.uv_px.y());
    if (z <= 0) return std::nullopt;
    const Vec3 p_b = T_b_a * camera.unproject(camera.undistort(f.uv_px.cast<double>()), z);
    if (p_b.z() < 0.2) return std::nullopt;
    const Vec2 uv = camera.distort(camera.project(p_b));
    if (!camera.contains(uv, 20)) return std::nullopt;
    const float z_b = depth_at(depth_b, uv.x(), uv.y());
    if (z_b <= 0 || std::abs(z_b - p_b.z()) > 0.05 * p_b.z()) return std::nullopt;
    return uv.cast<float>();
  };
}

bool table_of_sequence(const std::vector<Candidate>& candidates, const std::string& folder,
                       int count, int gap, std::vector<GreyImage>& samples) {
  const Sequence s = read_sequence(folder);
  if (s.frames.empty() || s.T_world_cam.empty() || s.camera.fx <= 0) {
    std::fprintf(stderr, "%s: no associations, poses or calibration\n", folder.c_str());
    return false;
  }
  const Camera camera(s.camera);
  const std::vector<double> tolerances_px = {3.0, 6.0};
  std::vector<std::vector<Score>> scores(tolerances_px.size(),
                                         std::vector<Score>(candidates.size()));
  const auto step = static_cast<std::size_t>(std::max(1, gap / 2));
  for (std::size_t i = 0; i + static_cast<std::size_t>(gap) < s.frames.size(); i += step) {
    const Frame& first = s.frames[i];
    const Frame& second = s.frames[i + static_cast<std::size_t>(gap)];
    const auto T_world_a = pose_at(s, first.t_s);
    const auto T_world_b = pose_at(s, second.t_s);
    const GreyImage image_a = read_grey(first.rgb);
    const GreyImage image_b = read_grey(second.rgb);
    if (!T_world_a || !T_world_b || image_a.empty() || image_b.empty()) continue;
    const DepthImage depth_a = read_depth(first.depth, s.camera.depth_scale);
    const DepthImage depth_b = read_depth(second.depth, s.camera.depth_scale);
    const auto a = extract_equal(candidates, image_a, count);
    const auto b = extract_equal(candidates, image_b, count);
    const SE3 T_b_a = refine_truth(camera, depth_a, a, b, T_world_b->inverse() * *T_world_a);
    const Truth truth = truth_of_pair(camera, depth_a, depth_b, T_b_a);
    for (std::size_t k = 0; k < tolerances_px.size(); ++k) {
      for (std::size_t c = 0; c < candidates.size(); ++c) {
        scores[k][c].add(score_pair(a[c], b[c], truth, tolerances_px[k]));
      }
    }
    if (i % (10 * step) == 0) samples.push_back(image_a);
  }
  const std::string name = folder.substr(folder.find_last_of('/') + 1);
  for (std::size_t k = 0; k < tolerances_px.size(); ++k) {
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      char what[96];
      std::snprintf(what, sizeof what, "%s, %.0f px", name.c_str(), tolerances_px[k]);
      print_row(what, candidates[c].name, scores[k][c]);
    }
  }
  return true;
}

}  // namespace

Features extract_with_opencv(const GreyImage& image, int count) {
  static const cv::Ptr<cv::ORB> orb = cv::ORB::create();
  orb->setMaxFeatures(count);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat bits;
  orb->detectAndCompute(cv_view(image), cv::noArray(), keypoints, bits);
  Features features;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const cv::KeyPoint& k = keypoints[i];
    Feature f;
    f.uv_px = {k.pt.x, k.pt.y};
    f.ideal_px = f.uv_px;
    f.angle_rad = static_cast<float>(k.angle * std::numbers::pi / 180.0);
    f.response = k.response;
    f.octave = static_cast<std::uint8_t>(k.octave);
    features.points.push_back(f);
    Descriptor d;
    std::copy_n(bits.ptr<std::uint8_t>(static_cast<int>(i)), 32,
                reinterpret_cast<std::uint8_t*>(d.bits.data()));
    features.descriptors.push_back(d);
  }
  if (static_cast<int>(features.size()) > count) {
    features.points.resize(static_cast<std::size_t>(count));
    features.descriptors.resize(static_cast<std::size_t>(count));
  }
  return features;
}

int print_tables(const std::vector<Candidate>& candidates,
                 const std::vector<std::string>& sequences, int count, int gap) {
  std::printf(
      "Equal count per image. repeat: share of the visible features found again, one to one, "
      "within\n"
      "the tolerance (3 px where none is named) and one octave. matches: mutual best, at most 64\n"
      "bits, ratio 0.8; correct: within the tolerance. err: median of the correct ones. spread:\n"
      "occupied cells of 40 px. Truth of sequences: depth and recorded poses, these corrected by\n"
      "all extractors' matches together; frames %d apart.\n\n",
      gap);
  print_header();
  std::vector<GreyImage> recorded;
  bool good = true;
  for (const std::string& folder : sequences) {
    good = table_of_sequence(candidates, folder, count, gap, recorded) && good;
  }
  if (!recorded.empty()) table_of_warps(candidates, "recorded frames", recorded, count);
  std::vector<GreyImage> rendered;
  for (unsigned seed = 1; seed <= 12; ++seed) rendered.push_back(render_texture(640, 480, seed));
  table_of_warps(candidates, "rendered", rendered, count);
  return good ? 0 : 4;
}

}  // namespace ygslam::bench
