// A room of painted blocks at many depths before a camera that is moved, and what can lie over its
// images: what the tests of masks need, without a pose anywhere.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "core/rng.hpp"
#include "image/pixel_mask.hpp"

namespace ygslam::tracking_test {

class OverlaidRoom {
 public:
  static constexpr int kWidth_px = 640, kHeight_px = 480;
  static constexpr double kFrame_s = 1.0 / 30;

  explicit OverlaidRoom(std::uint64_t seed) : blocks_(std::size_t{kSide} * kSide) {
    Rng rng(seed);
    for (Block& block : blocks_)
      block = {static_cast<std::uint8_t>(30 + rng.below(200)),
               1.0F + 0.01F * static_cast<float>(rng.below(250))};
  }

  /// What the camera sees with its image moved by so much [px].
  [[nodiscard]] std::shared_ptr<RgbdFrame> see(int number, double right_px, double down_px) const {
    auto frame = std::make_shared<RgbdFrame>();
    frame->id = FrameId{static_cast<std::uint32_t>(number)};
    frame->stamp = {to_ns(100 + number * kFrame_s)};
    frame->colour = ColourImage(kWidth_px, kHeight_px);
    frame->grey = GreyImage(kWidth_px, kHeight_px);
    frame->depth_m = DepthImage(kWidth_px, kHeight_px);
    for (int v = 0; v < kHeight_px; ++v) {
      for (int u = 0; u < kWidth_px; ++u) {
        frame->grey.at(u, v) = grey_at(u + right_px, v + down_px);
        frame->depth_m.at(u, v) = at(u + right_px, v + down_px).depth_m;
      }
    }
    return frame;
  }

  /// Random letters, white, over the upper left. @return the pixels they cover.
  static GreyImage write_text(RgbdFrame& frame) {
    GreyImage covered(kWidth_px, kHeight_px);
    Rng rng(5);
    for (int letter = 0; letter < 16; ++letter) {
      for (int part = 0; part < 12; ++part) {  // of 3 x 4 squares of 4 px
        const bool is_stroke = rng.below(3) != 0;
        for (int dv = 0; is_stroke && dv < 4; ++dv) {
          for (int du = 0; du < 4; ++du) {
            const int u = 10 + 16 * letter + 4 * (part % 3) + du, v = 10 + 4 * (part / 3) + dv;
            frame.grey.at(u, v) = 250;
            covered.at(u, v) = 255;
          }
        }
      }
    }
    return covered;
  }
  /// The lowest 60 rows: a painted thing near by, half of it without texture.
  static GreyImage add_bonnet(RgbdFrame& frame) {
    GreyImage covered(kWidth_px, kHeight_px);
    Rng rng(6);
    std::vector<std::uint8_t> paint(std::size_t{40} * 4);
    for (auto& grey : paint) grey = static_cast<std::uint8_t>(40 + rng.below(180));
    for (int v = kHeight_px - 60; v < kHeight_px; ++v) {
      for (int u = 0; u < kWidth_px; ++u) {
        const int row = (v - kHeight_px + 60) / 16;
        frame.grey.at(u, v) =
            u < kWidth_px / 2 ? paint[static_cast<std::size_t>(u / 16 * 4 + row)] : 90;
        frame.depth_m.at(u, v) = 0.45F;
        covered.at(u, v) = 255;
      }
    }
    return covered;
  }
  static GreyImage add_dirt(RgbdFrame& frame) {
    GreyImage covered(kWidth_px, kHeight_px);
    Rng rng(7);
    for (int speck = 0; speck < 40; ++speck) {
      const int u0 = 20 + static_cast<int>(rng.below(600)),
                v0 = 20 + static_cast<int>(rng.below(440));
      for (int v = v0 - 4; v <= v0 + 4; ++v) {
        for (int u = u0 - 4; u <= u0 + 4; ++u) {
          if (std::hypot(u - u0, v - v0) > 4) continue;
          frame.grey.at(u, v) = 5;
          covered.at(u, v) = 255;
        }
      }
    }
    return covered;
  }
  /// Somebody 0.9 m away who covers the columns from left_px on.
  static void add_person(RgbdFrame& frame, int left_px, int width_px) {
    Rng rng(8);
    std::vector<std::uint8_t> clothes(std::size_t{50} * 50);
    for (auto& grey : clothes) grey = static_cast<std::uint8_t>(rng.below(256));
    for (int v = 0; v < kHeight_px; ++v) {
      for (int u = std::max(0, left_px); u < std::min(kWidth_px, left_px + width_px); ++u) {
        frame.grey.at(u, v) = clothes[static_cast<std::size_t>((u - left_px) / 14 * 50 + v / 14)];
        frame.depth_m.at(u, v) = 0.9F;
      }
    }
  }

 private:
  struct Block {
    std::uint8_t grey = 0;
    float depth_m = 0;
  };
  static constexpr int kSide = 64;
  static constexpr double kBlock_px = 22;

  [[nodiscard]] const Block& at(double x_px, double y_px) const {
    const auto cell = [](double px) {
      return static_cast<int>(std::floor(px / kBlock_px)) & (kSide - 1);
    };
    return blocks_[static_cast<std::size_t>(cell(y_px) * kSide + cell(x_px))];
  }
  /// Between two pixels as much of each.
  [[nodiscard]] std::uint8_t grey_at(double x_px, double y_px) const {
    double sum = 0;
    for (const double dy : {-0.25, 0.25})
      for (const double dx : {-0.25, 0.25}) sum += at(x_px + dx, y_px + dy).grey;
    return static_cast<std::uint8_t>(sum / 4);
  }

  std::vector<Block> blocks_;
};

}  // namespace ygslam::tracking_test
