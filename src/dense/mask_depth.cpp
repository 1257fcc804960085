#include "dense/mask_depth.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace ygslam {
namespace {

constexpr double kLargeShare = 0.33;  // of the largest part: an object behind a pole has two such

struct Part {
  std::vector<int> pixels;  // offsets
  double near_m = 0, far_m = 0;
};

/// Finds what hangs together in masks: neighbours of one number without a jump in depth.
class Parts {
 public:
  Parts(const DepthView& view, const PreparationConfig& config)
      : view_(view),
        config_(config),
        noise_(config.noise),
        done_(view.depth.width(), view.depth.height()) {}

  /// The part that holds a pixel; empty where it is none of an object, or of a part told of before.
  [[nodiscard]] Part take(int u, int v) {
    Part part;
    if (done_.at(u, v) != 0 || !is_object(u, v)) return part;
    part.near_m = part.far_m = depth_m(u, v);
    add(u, v, part);
    for (std::size_t next = 0; next < part.pixels.size(); ++next) {
      const int x = part.pixels[next] % done_.width(), y = part.pixels[next] / done_.width();
      if (is_at_jump(x, y)) continue;  // a pixel between two surfaces belongs to neither
      for (const auto& [nx, ny] : {std::pair{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
        if (!done_.contains(nx, ny) || done_.at(nx, ny) != 0 || !is_object(nx, ny)) continue;
        if (view_.object.at(nx, ny) == view_.object.at(u, v) && !jumps(x, y, nx, ny))
          add(nx, ny, part);
      }
    }
    return part;
  }
  [[nodiscard]] double margin_m(double depth) const {
    return config_.jump_m +
           config_.jump_sigmas * static_cast<double>(noise_.sigma_m(static_cast<float>(depth)));
  }

 private:
  [[nodiscard]] double depth_m(int u, int v) const {
    return view_.depth.at(u, v) * DepthView::kUnit_m;
  }
  [[nodiscard]] bool is_object(int u, int v) const {
    return DepthView::is_object(view_.object.at(u, v)) && view_.depth.at(u, v) != 0;
  }
  [[nodiscard]] bool jumps(int u, int v, int x, int y) const {
    const double a = depth_m(u, v), b = depth_m(x, y);
    return std::abs(a - b) > margin_m(std::min(a, b));
  }
  [[nodiscard]] bool is_at_jump(int u, int v) const {
    for (const auto& [x, y] : {std::pair{u - 1, v}, {u + 1, v}, {u, v - 1}, {u, v + 1}})
      if (done_.contains(x, y) && view_.depth.at(x, y) != 0 && jumps(u, v, x, y)) return true;
    return false;
  }
  void add(int u, int v, Part& part) {
    done_.at(u, v) = 1;
    part.pixels.push_back(v * done_.width() + u);
    const double depth = depth_m(u, v);
    part.near_m = std::min(part.near_m, depth);
    part.far_m = std::max(part.far_m, depth);
  }

  const DepthView& view_;
  const PreparationConfig& config_;
  NoiseModel noise_;
  GreyImage done_;
};

}  // namespace

void drop_what_lies_elsewhere(DepthView& view, const PreparationConfig& config) {
  std::vector<std::vector<Part>> parts_of(view.objects.size());
  Parts parts(view, config);
  for (int v = 0; v < view.depth.height(); ++v) {
    for (int u = 0; u < view.depth.width(); ++u) {
      Part part = parts.take(u, v);
      if (!part.pixels.empty()) parts_of[view.object.at(u, v) - 1U].push_back(std::move(part));
    }
  }
  for (const std::vector<Part>& of_one : parts_of) {
    const auto largest = std::max_element(
        of_one.begin(), of_one.end(),
        [](const Part& a, const Part& b) { return a.pixels.size() < b.pixels.size(); });
    for (const Part& part : of_one) {
      const double margin_m = parts.margin_m(part.near_m);
      const bool lies_there =
          part.near_m >= largest->near_m - margin_m && part.far_m <= largest->far_m + margin_m;
      if (lies_there || static_cast<double>(part.pixels.size()) >
                            kLargeShare * static_cast<double>(largest->pixels.size()))
        continue;
      for (const int pixel : part.pixels) view.object.data()[pixel] = DepthView::kUnsure;
    }
  }
}

}  // namespace ygslam
