#include "eval/tracking_score.hpp"

#include <cmath>
#include <limits>

#include "core/assignment.hpp"
#include "core/check.hpp"

namespace ygslam {
namespace {

using Matrix = Eigen::MatrixXd;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kIgnoredShare = 0.5;   // of a tracked box within what does not count
constexpr double kKeepsPartner = 1000;  // outweighs every sum of similarities

double ratio(double part, double whole) { return part / std::max(1.0, whole); }

/// Ids as rows and columns of a table over the whole sequence.
struct Counted {
  std::map<int, int> row, column;
  Eigen::VectorXd truth_frames, tracked_frames;
  double truths = 0, trackeds = 0;
};

Counted count(std::span<const SimilarityFrame> frames) {
  std::map<int, int> truth, tracked;
  for (const SimilarityFrame& frame : frames) {
    CHECK(frame.similarity.rows() == std::ssize(frame.truth) &&
          frame.similarity.cols() == std::ssize(frame.tracked));
    for (const int id : frame.truth) ++truth[id];
    for (const int id : frame.tracked) ++tracked[id];
  }
  Counted counted;
  const auto number = [](const std::map<int, int>& times, std::map<int, int>& place,
                         Eigen::VectorXd& frames_of) {
    frames_of.resize(std::ssize(times));
    for (const auto& [id, n] : times) {
      const auto at = static_cast<int>(place.size());
      place[id] = at;
      frames_of[at] = n;
    }
    return frames_of.sum();
  };
  counted.truths = number(truth, counted.row, counted.truth_frames);
  counted.trackeds = number(tracked, counted.column, counted.tracked_frames);
  return counted;
}

/// Calls visit(row of the truth, column of the tracked, similarity) for all pairs of a frame.
template <typename Visit>
void each_pair(const SimilarityFrame& frame, const Counted& counted, Visit&& visit) {
  for (Eigen::Index i = 0; i < frame.similarity.rows(); ++i)
    for (Eigen::Index j = 0; j < frame.similarity.cols(); ++j)
      visit(counted.row.at(frame.truth[i]), counted.column.at(frame.tracked[j]), i, j);
}

/// Frames that two ids have when n of them are common.
double either(const Counted& counted, Eigen::Index row, Eigen::Index column, double n) {
  return counted.truth_frames[row] + counted.tracked_frames[column] - n;
}

/// How well the ids fit each other over the sequence, before each gets but one partner.
Matrix global_alignment(std::span<const SimilarityFrame> frames, const Counted& counted) {
  Matrix common = Matrix::Zero(counted.truth_frames.size(), counted.tracked_frames.size());
  for (const SimilarityFrame& frame : frames) {
    const Eigen::VectorXd of_truth = frame.similarity.rowwise().sum();
    const Eigen::VectorXd of_tracked = frame.similarity.colwise().sum();
    each_pair(frame, counted, [&](int row, int column, Eigen::Index i, Eigen::Index j) {
      const double s = frame.similarity(i, j);
      const double all = of_truth[i] + of_tracked[j] - s;
      if (all > kEpsilon) common(row, column) += s / all;
    });
  }
  for (Eigen::Index r = 0; r < common.rows(); ++r)
    for (Eigen::Index c = 0; c < common.cols(); ++c)
      common(r, c) /= either(counted, r, c, common(r, c));
  return common;
}

/// Luiten et al. 2021, eqs. (2) to (6) and (12).
void add_hota(std::span<const SimilarityFrame> frames, const Counted& counted,
              TrackingScore& score) {
  constexpr int kAlphas = 19;
  const Matrix fit = global_alignment(frames, counted);
  std::vector<Matrix> matches(kAlphas, Matrix::Zero(fit.rows(), fit.cols()));
  for (const SimilarityFrame& frame : frames) {
    Matrix cost(frame.similarity.rows(), frame.similarity.cols());
    each_pair(frame, counted, [&](int row, int column, Eigen::Index i, Eigen::Index j) {
      cost(i, j) = -fit(row, column) * frame.similarity(i, j);
    });
    const std::vector<int> partner = assign(cost);
    for (std::size_t i = 0; i < partner.size(); ++i) {
      if (partner[i] < 0) continue;
      const double s = frame.similarity(static_cast<Eigen::Index>(i), partner[i]);
      for (int a = 0; a < kAlphas; ++a)
        if (s >= 0.05 * (a + 1) - kEpsilon)
          ++matches[a](counted.row.at(frame.truth[i]),
                       counted.column.at(frame.tracked[partner[i]]));
    }
  }
  for (const Matrix& n : matches) {
    const double found = n.sum();
    double sum = 0;
    for (Eigen::Index r = 0; r < n.rows(); ++r)
      for (Eigen::Index c = 0; c < n.cols(); ++c)
        sum += n(r, c) * ratio(n(r, c), either(counted, r, c, n(r, c)));
    const double ass_a = ratio(sum, found);
    const double det_a = ratio(found, counted.truths + counted.trackeds - found);
    score.ass_a += ass_a / kAlphas;
    score.det_a += det_a / kAlphas;
    score.hota += std::sqrt(ass_a * det_a) / kAlphas;
  }
}

/// Ristani et al. 2016: one partner per id for the whole sequence.
void add_identity(std::span<const SimilarityFrame> frames, const Counted& counted,
                  TrackingScore& score) {
  Matrix common = Matrix::Zero(counted.truth_frames.size(), counted.tracked_frames.size());
  for (const SimilarityFrame& frame : frames)
    each_pair(frame, counted, [&](int row, int column, Eigen::Index i, Eigen::Index j) {
      if (frame.similarity(i, j) >= kSameBoxIou) ++common(row, column);
    });
  double found = 0;
  const std::vector<int> partner = assign(-common);
  for (std::size_t r = 0; r < partner.size(); ++r)
    if (partner[r] >= 0) found += common(static_cast<Eigen::Index>(r), partner[r]);
  score.id_precision = ratio(found, counted.trackeds);
  score.id_recall = ratio(found, counted.truths);
  score.idf1 = ratio(2 * found, counted.truths + counted.trackeds);
}

/// Bernardin, Stiefelhagen 2008: pairs of the frame before stay while they are alike enough.
void add_clear(std::span<const SimilarityFrame> frames, const Counted& counted,
               TrackingScore& score) {
  std::map<int, int> before, ever;  // truth id to tracked id: in the last frame, last of all
  for (const SimilarityFrame& frame : frames) {
    for (const int id : frame.tracked) ++score.false_frames[id];
    if (frame.truth.empty() || frame.tracked.empty()) continue;
    Matrix cost = Matrix::Zero(frame.similarity.rows(), frame.similarity.cols());
    for (Eigen::Index i = 0; i < cost.rows(); ++i) {
      const auto last = before.find(frame.truth[i]);
      for (Eigen::Index j = 0; j < cost.cols(); ++j) {
        const double s = frame.similarity(i, j);
        if (s < kSameBoxIou - kEpsilon) continue;
        const bool same = last != before.end() && last->second == frame.tracked[j];
        cost(i, j) = -s - (same ? kKeepsPartner : 0);
      }
    }
    before.clear();
    const std::vector<int> partner = assign(cost);
    for (std::size_t i = 0; i < partner.size(); ++i) {
      if (partner[i] < 0 || cost(static_cast<Eigen::Index>(i), partner[i]) >= 0) continue;
      const int tracked = frame.tracked[partner[i]];
      before[frame.truth[i]] = tracked;
      --score.false_frames[tracked];
      const auto [last, first] = ever.try_emplace(frame.truth[i], tracked);
      if (!first && last->second != tracked) ++score.switches[frame.truth[i]], ++score.id_switches;
      last->second = tracked;
      ++score.found;
    }
  }
  score.missed = static_cast<std::size_t>(counted.truths) - score.found;
  score.false_alarms = static_cast<std::size_t>(counted.trackeds) - score.found;
  score.mota = ratio(static_cast<double>(score.found) - static_cast<double>(score.false_alarms) -
                         static_cast<double>(score.id_switches),
                     counted.truths);
}

}  // namespace

SimilarityFrame compare(const BoxFrame& frame) {
  const auto similarity = [](std::span<const IdBox> truth, std::span<const IdBox> tracked) {
    Matrix result(std::ssize(truth), std::ssize(tracked));
    for (Eigen::Index i = 0; i < result.rows(); ++i)
      for (Eigen::Index j = 0; j < result.cols(); ++j)
        result(i, j) = iou(truth[i].box, tracked[j].box);
    return result;
  };
  const Matrix all = similarity(frame.truth, frame.tracked);
  std::vector<char> left_out(frame.tracked.size(), 0);
  const Matrix cost = (all.array() >= kSameBoxIou).select(-all, 0.0);
  const std::vector<int> partner = assign(cost);
  std::vector<char> found(frame.tracked.size(), 0);
  for (std::size_t i = 0; i < partner.size(); ++i)
    if (partner[i] >= 0 && cost(static_cast<Eigen::Index>(i), partner[i]) < 0)
      (frame.truth[i].counts ? found : left_out)[partner[i]] = 1;
  for (std::size_t j = 0; j < left_out.size(); ++j) {
    const PixelBox& box = frame.tracked[j].box;
    for (const IdBox& truth : frame.truth)
      if (!truth.counts && !found[j] && (truth.box & box).area() >= kIgnoredShare * box.area())
        left_out[j] = 1;
  }
  std::vector<IdBox> truth, tracked;
  for (const IdBox& box : frame.truth)
    if (box.counts) truth.push_back(box);
  for (std::size_t j = 0; j < frame.tracked.size(); ++j)
    if (!left_out[j]) tracked.push_back(frame.tracked[j]);
  SimilarityFrame result{{}, {}, similarity(truth, tracked)};
  for (const IdBox& box : truth) result.truth.push_back(box.id);
  for (const IdBox& box : tracked) result.tracked.push_back(box.id);
  return result;
}

TrackingScore score_tracking(std::span<const SimilarityFrame> frames) {
  const Counted counted = count(frames);
  TrackingScore score;
  for (const auto& [id, row] : counted.row)
    score.truth_frames[id] = static_cast<std::size_t>(counted.truth_frames[row]);
  for (const auto& [id, column] : counted.column)
    score.tracked_frames[id] = static_cast<std::size_t>(counted.tracked_frames[column]);
  add_hota(frames, counted, score);
  add_identity(frames, counted, score);
  add_clear(frames, counted, score);
  return score;
}

}  // namespace ygslam
