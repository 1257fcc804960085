#include <algorithm>
#include <cmath>

#include "simulation/surface/painters.hpp"

namespace ygslam::sim {

namespace {

PaintedMaterial books(int variant, int size) {
  Rng rng(seed_of(variant, 22));
  const int width = size;
  const int height = size * 3 / 8;
  ColourImage image(width, height, to_rgb({34, 28, 24}));
  int u = 0;
  while (u < width) {
    const int w = 8 + static_cast<int>(rng.below(22));
    const int top = static_cast<int>(rng.below(static_cast<std::uint32_t>(height / 4)));
    const auto brightness = static_cast<float>(rng.uniform(0.25, 0.95));
    const Paint cover = random_paint(rng, static_cast<float>(rng.uniform(0.1, 0.8)), brightness);
    fill_rect(image, u, top, u + w - 1, height, cover);
    const Paint ink = cover.r + cover.g + cover.b > 380 ? Paint{30, 30, 40} : Paint{235, 230, 210};
    const int label = top + height / 8 + static_cast<int>(rng.below(20));
    for (int v = label; v < label + height / 3; v += 5) {
      fill_rect(image, u + w / 4, v, u + w - w / 4, v + 3, ink);
    }
    fill_rect(image, u, height - height / 6, u + w - 1, height - height / 6 + 6, ink);
    u += w;
  }
  return tiled(std::move(image), 1.2F, 0.32F);
}

PaintedMaterial poster(int variant, int size) {
  Rng rng(seed_of(variant, 23));
  const int width = size * 3 / 4;
  const int height = size;
  const Paint paper = rng.below(3) == 0 ? random_paint(rng, 0.35F, 0.85F) : Paint{236, 232, 224};
  ColourImage image(width, height, to_rgb(paper));
  const Paint title = random_paint(rng, 0.8F, 0.6F);
  fill_rect(image, 0, 0, width, height / 8, title);
  draw_text(image, width / 12, height / 40, width * 11 / 12, height / 8 - 4, height / 14,
            {245, 245, 245}, rng);
  const int columns = 1 + static_cast<int>(rng.below(3));
  for (int c = 0; c < columns; ++c) {
    const int u0 = width / 20 + c * (width * 19 / 20) / columns;
    const int u1 = u0 + (width * 18 / 20) / columns - 6;
    int v = height / 6;
    while (v < height - height / 6) {
      const int block =
          height / 9 + static_cast<int>(rng.below(static_cast<std::uint32_t>(height / 5)));
      const int low = std::min(v + block, height - height / 20);
      if (rng.below(2) == 0) {
        draw_photo(image, u0, v, u1, low - 6, rng);
      } else {
        draw_text(image, u0, v, u1, low - 6, 7 + static_cast<int>(rng.below(8)), {40, 40, 50}, rng);
      }
      v = low;
    }
  }
  fill_rect(image, 0, height - height / 24, width, height, title);
  return fitted(std::move(image));
}

PaintedMaterial paper(int variant, int size) {
  Rng rng(seed_of(variant, 24));
  ColourImage image(size / 4, size / 3, to_rgb({240, 240, 236}));
  draw_text(image, 8, 10, size / 4 - 8, size / 3 - 10, 7, {50, 50, 60}, rng);
  if (variant % 2 == 0) draw_photo(image, 14, 24, size / 4 - 14, size / 8, rng);
  return fitted(std::move(image));
}

PaintedMaterial keyboard(int variant, int size) {
  ColourImage image(size / 2, size / 5, to_rgb({28, 28, 30}));
  Rng rng(seed_of(variant, 25));
  const int rows = 5;
  const int columns = 18;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int u = 4 + c * (image.width() - 8) / columns;
      const int v = 4 + r * (image.height() - 8) / rows;
      const auto k = static_cast<float>(rng.uniform(0.8, 1.2));
      fill_rect(image, u + 1, v + 1, u + (image.width() - 8) / columns - 1,
                v + (image.height() - 8) / rows - 2, Paint{72, 72, 76} * k);
      fill_rect(image, u + 4, v + 4, u + 7, v + 8, {190, 190, 190});
    }
  }
  PaintedMaterial painted = fitted(std::move(image));
  painted.material.ir_return = 0.5F;
  return painted;
}

ColourImage desktop_image(int variant, int size) {
  Rng rng(seed_of(variant, 26));
  const int w = size * 3 / 4;
  const int h = size / 2;
  ColourImage image(w, h);
  draw_photo(image, 0, 0, w, h, rng);
  for (int i = 0; i < 3; ++i) {
    const int u = static_cast<int>(rng.below(static_cast<std::uint32_t>(w / 2)));
    const int v = static_cast<int>(rng.below(static_cast<std::uint32_t>(h / 3)));
    const int u1 = std::min(w - 4, u + w / 2);
    const int v1 = std::min(h - 16, v + h / 2);
    const bool dark = rng.below(2) == 0;
    fill_rect(image, u, v, u1, v1, dark ? Paint{30, 32, 38} : Paint{244, 244, 246});
    fill_rect(image, u, v, u1, v + 10, {90, 110, 150});
    draw_text(image, u + 6, v + 16, u1 - 6, v1 - 4, 8,
              dark ? Paint{150, 220, 150} : Paint{40, 40, 50}, rng);
  }
  fill_rect(image, 0, h - 12, w, h, {40, 44, 52});
  return image;
}

PaintedMaterial screen(int variant, int size) {
  PaintedMaterial painted = fitted(desktop_image(variant, size));
  painted.material.glow = 0.8F;
  painted.material.ir_return = 0.6F;
  return painted;
}

PaintedMaterial screen_off(int /*variant*/, int /*size*/) {
  ColourImage image(64, 48, to_rgb({26, 27, 30}));
  PaintedMaterial painted = fitted(std::move(image));
  painted.material.shine = 0.25F;
  painted.material.ir_return = 0.08F;
  return painted;
}

/// What a video shows, by the hundreds of its variant.
enum class VideoStyle : std::uint8_t { kPan, kSlowPan, kScroll, kCuts, kZoom, kSlowScroll, kCount };

constexpr int kVideoFrames = 40;  // four seconds at 10 Hz

/// The backdrop as a frame shows it. @param phase 0..1 through the video.
ColourImage backdrop_at(const ColourImage& backdrop, VideoStyle style, float phase) {
  const int w = backdrop.width();
  const int h = backdrop.height();
  const float swing = std::sin(6.2831853F * phase);
  const float pan = style == VideoStyle::kPan ? 0.1F : style == VideoStyle::kSlowPan ? 0.025F : 0;
  const float scroll = style == VideoStyle::kScroll       ? 1
                       : style == VideoStyle::kSlowScroll ? 0.1F
                                                          : 0;
  const int right = static_cast<int>(std::lround(pan * swing * static_cast<float>(w)));
  const int down = static_cast<int>(std::lround(scroll * phase * static_cast<float>(h)));
  const float zoom = style == VideoStyle::kZoom ? 1 + 0.1F * swing : 1;
  const auto zoomed = [&](int x, int size) {
    const float middle = 0.5F * static_cast<float>(size);
    return static_cast<int>(std::lround(middle + (static_cast<float>(x) - middle) * zoom));
  };
  ColourImage image(w, h);
  for (int v = 0; v < h; ++v)
    for (int u = 0; u < w; ++u)
      image.at(u, v) =
          backdrop.at(((zoomed(u, w) + right) % w + w) % w, ((zoomed(v, h) + down) % h + h) % h);
  return image;
}

PaintedMaterial video(int variant, int size) {
  PaintedMaterial painted;
  painted.material.glow = 0.9F;
  painted.material.ir_return = 0.6F;
  const auto style = static_cast<VideoStyle>(variant / 100 % static_cast<int>(VideoStyle::kCount));
  const int w = size / 2;
  const int h = size * 9 / 32;
  Rng setup(seed_of(variant, 27));
  ColourImage backdrop(w, h);
  draw_photo(backdrop, 0, 0, w, h, setup);
  const Paint actor = random_paint(setup, 0.7F, 0.9F);
  for (int i = 0; i < kVideoFrames; ++i) {
    if (style == VideoStyle::kCuts && i > 0 && i % 10 == 0) draw_photo(backdrop, 0, 0, w, h, setup);
    const float phase = 6.2831853F * static_cast<float>(i) / kVideoFrames;
    ColourImage image =
        backdrop_at(backdrop, style, static_cast<float>(i) / static_cast<float>(kVideoFrames));
    const int cu = w / 2 + static_cast<int>(0.35F * static_cast<float>(w) * std::cos(phase));
    const int cv = h / 2 + static_cast<int>(0.2F * static_cast<float>(h) * std::sin(2 * phase));
    fill_rect(image, cu - 22, cv - 10, cu + 22, cv + 34, actor);
    fill_disc(image, cu, cv - 20, 12, actor * 0.7F);
    painted.frames.push_back(std::move(image));
  }
  return painted;
}

PaintedMaterial cardboard(int variant, int size) {
  Rng rng(seed_of(variant, 28));
  const int s = size / 2;
  ColourImage image(s, s, to_rgb({184, 142, 96}));
  add_grain(image, 16, 4, 0.18F, seed_of(variant, 29));
  fill_rect(image, 0, s / 2 - s / 14, s, s / 2 + s / 14, {206, 184, 140});
  fill_rect(image, s / 10, s / 8, s / 2, s * 2 / 5, {236, 234, 228});
  draw_text(image, s / 10 + 6, s / 8 + 6, s / 2 - 6, s * 2 / 5 - 4, s / 22, {40, 40, 40}, rng);
  draw_photo(image, s * 5 / 8, s / 8, s * 9 / 10, s * 2 / 5, rng);
  draw_text(image, s / 8, s * 5 / 8, s * 7 / 8, s * 15 / 16, s / 10, {70, 48, 30}, rng);
  return fitted(std::move(image));
}

PaintedMaterial ball(int variant, int size) {
  Rng rng(seed_of(variant, 30));
  ColourImage image(size / 4, size / 4, to_rgb(random_paint(rng, 0.8F, 0.9F)));
  for (int i = 0; i < 14; ++i) {
    const auto edge = static_cast<std::uint32_t>(size / 4);
    const Paint ink = random_paint(rng, 0.6F, static_cast<float>(rng.uniform(0.2, 1)));
    const int radius = size / 40 + static_cast<int>(rng.below(edge / 10 + 1));
    const auto v = static_cast<int>(rng.below(edge));
    fill_disc(image, static_cast<int>(rng.below(edge)), v, radius, ink);
  }
  return tiled(std::move(image), 0.7F, 0.36F);
}

PaintedMaterial whiteboard(int variant, int size) {
  Rng rng(seed_of(variant, 31));
  ColourImage image(size * 3 / 4, size / 2, to_rgb({244, 246, 248}));
  const int w = image.width();
  const int h = image.height();
  for (int i = 0; i < 5; ++i) {
    const Paint ink = random_paint(rng, 0.9F, 0.5F);
    const int u = static_cast<int>(rng.below(static_cast<std::uint32_t>(w * 2 / 3)));
    const int v = static_cast<int>(rng.below(static_cast<std::uint32_t>(h * 2 / 3)));
    draw_text(image, u, v, std::min(w - 8, u + w / 3), std::min(h - 8, v + h / 4), 16, ink, rng);
    draw_frame(image, u, v + h / 5, std::min(w - 4, u + w / 6), std::min(h - 4, v + h / 3), 2, ink);
  }
  draw_frame(image, 0, 0, w, h, 5, {150, 154, 160});
  PaintedMaterial painted = fitted(std::move(image));
  painted.material.shine = 0.2F;
  return painted;
}

PaintedMaterial plant(int variant, int size) {
  ColourImage image(size / 8, size / 8, to_rgb({60, 110, 52}));
  add_grain(image, 8, 3, 0.9F, seed_of(variant, 33));
  return tiled(std::move(image), 0.25F, 0.25F);
}

}  // namespace

const PainterTable& office_painters() {
  static const PainterTable table = {
      {"books", books},   {"poster", poster},         {"paper", paper}, {"keyboard", keyboard},
      {"screen", screen}, {"screen_off", screen_off}, {"video", video}, {"cardboard", cardboard},
      {"ball", ball},     {"whiteboard", whiteboard}, {"plant", plant}};
  return table;
}

}  // namespace ygslam::sim
