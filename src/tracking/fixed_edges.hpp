// Edges that stay at their pixels while the rest of the image goes on: of text laid over the image,
// dirt on the lens, the vehicle that carries the camera. Needs no pose, which such edges may have
// spoilt.
//
// Samples are taken where the image has changed broadly since the last one, so a camera that stands
// or is slow gives none. A pixel's gradient is held against one it had earlier: over samples, those
// of the world are random, those of the camera alike (the idea of Dekel et al., CVPR 2017, "On the
// effectiveness of visible watermarks", eq. 2, which takes their median over images).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "image/image.hpp"

namespace ygslam {

struct FixedEdgesConfig {
  int width_px = 320;  ///< images are reduced to about this width
  /// Gradient [grey levels per reduced pixel] of an edge, and below which there is none.
  int edge = 8, no_edge = 4;
  double textured_tiles = 0.15;    ///< of all: with fewer the image tells nothing
  double moved_tiles = 0.6;        ///< of the textured ones, for a sample
  double moved_in_quarter = 0.34;  ///< of those in a quarter of the image, in three of the four
};

class FixedEdges {
 public:
  /// Squares of the reduced image, the unit in which regions are made.
  static constexpr int kCell_px = 4;
  /// A pixel gains and loses so much by a sample; from kFixed on it counts as fixed, and does so
  /// until it has fallen to kFree.
  static constexpr int kGain = 4, kLoss = 8, kLossUnseen = 3, kMost = 64, kFixed = 32, kFree = 12;

  /// What a square of the image shows.
  struct Cell {
    std::uint8_t edges = 0;    ///< pixels, now or at the last sample
    std::uint8_t stayed = 0;   ///< of these: as they were at the last sample
    std::uint8_t fixed = 0;    ///< pixels that count as fixed
    std::uint8_t alike = 0;    ///< pixels with the edge that was seen there earlier
    std::uint8_t passing = 0;  ///< pixels with another edge
    /// Sums over the fixed pixels of the products of their gradient's direction: xx, xy, yy.
    std::array<float, 3> direction{};
    /// Nothing has come before what was there.
    [[nodiscard]] bool shows_the_same() const { return alike >= 2 && 2 * passing <= alike; }
    [[nodiscard]] bool moved() const { return edges >= 3 && 2 * stayed < edges; }
  };

  explicit FixedEdges(const FixedEdgesConfig& config) : config_(config) {}

  /// Of each image in turn. @return whether it was a sample: the rest is of the newest one.
  bool step(const GreyImage& image);

  [[nodiscard]] int samples() const { return samples_; }  ///< so far
  [[nodiscard]] int scale() const { return scale_; }      ///< pixels of the image to a reduced one
  [[nodiscard]] const Image<Cell>& cells() const { return cells_; }
  /// 255 = fixed; of the reduced image.
  [[nodiscard]] const GreyImage& fixed() const { return fixed_; }

 private:
  /// Of all pixels, each component by itself: loops over rows are taken in wide steps.
  struct Gradients {
    Image<std::int8_t> x, y;
  };
  /// Pixels of a kind in each column of a row of cells.
  using Columns = std::vector<std::uint8_t>;

  void start(const GreyImage& image);
  void reduce(const GreyImage& image);
  void reduce_row(const std::uint16_t* sums, std::uint32_t share, int v);
  void find_gradients();
  void compare_with_last();
  void compare_row(int v);
  [[nodiscard]] bool has_moved() const;
  void judge_pixels();
  void hold_against_reference(int v);
  void take_references(int v);
  void judge_row(int v);
  void add_directions(int v);
  void add(const std::uint8_t* row, Columns& count) const;
  [[nodiscard]] int pixels_of(const Columns& columns, int cell) const;

  FixedEdgesConfig config_;
  int scale_ = 0, samples_ = 0;
  int image_width_ = 0, image_height_ = 0;
  GreyImage reduced_;
  Gradients now_, last_, reference_;  // last_: of the last sample
  GreyImage score_, fixed_;
  Image<Cell> cells_;
  // Of a row's pixels. strength_: 0 none, 1 little, 2 an edge; the others: 255 = yes.
  Columns is_alike_, strength_, agrees_, other_edge_;
  Columns edges_, stayed_, alike_, passing_, fixed_count_;
};

}  // namespace ygslam
