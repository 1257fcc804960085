#include "dense/stored_view.hpp"

#include <zstd.h>

#include <new>
#include <utility>

#include "core/check.hpp"

namespace ygslam {
namespace {

constexpr int kLevel = 1;   // of zstd: fast; higher ones save a tenth
constexpr int kPlanes = 6;  // depth low and high byte, red, green, blue, object

std::uint8_t coarse(std::uint8_t value, int bits) {
  const int step = 1 << (8 - bits);
  return static_cast<std::uint8_t>((value & ~(step - 1)) | (step / 2));
}

/// Neighbours are alike: differences are small and compress well.
void to_differences(std::string& plane) {
  char before = 0;
  for (char& value : plane) value = static_cast<char>(value - std::exchange(before, value));
}
void from_differences(char* plane, std::size_t size) {
  for (std::size_t i = 1; i < size; ++i) plane[i] = static_cast<char>(plane[i] + plane[i - 1]);
}

}  // namespace

StoredView::StoredView(DepthView& view) : camera_(view.camera), objects_(view.objects) {
  for (Rgb8& colour : view.colour)
    colour = {coarse(colour.r, 5), coarse(colour.g, 6), coarse(colour.b, 5)};
  const std::size_t pixels = view.depth.size();
  std::string raw;
  raw.reserve(kPlanes * pixels);
  const auto add_plane = [&](auto byte_of) {
    std::string plane(pixels, '\0');
    for (std::size_t i = 0; i < pixels; ++i) plane[i] = static_cast<char>(byte_of(i));
    to_differences(plane);
    raw += plane;
  };
  const auto depth = view.depth.begin();
  const auto colour = view.colour.begin();
  const auto object = view.object.begin();
  // The high byte alone hardly ever changes; the low one is taken as the difference of the whole.
  std::string low(pixels, '\0'), high(pixels, '\0');
  std::uint16_t before = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto difference = static_cast<std::uint16_t>(depth[i] - std::exchange(before, depth[i]));
    low[i] = static_cast<char>(difference & 0xff);
    high[i] = static_cast<char>(difference >> 8);
  }
  raw += low + high;
  add_plane([&](std::size_t i) { return colour[i].r; });
  add_plane([&](std::size_t i) { return colour[i].g; });
  add_plane([&](std::size_t i) { return colour[i].b; });
  add_plane([&](std::size_t i) { return object[i]; });
  packed_.resize(ZSTD_compressBound(raw.size()));
  const std::size_t size =
      ZSTD_compress(packed_.data(), packed_.size(), raw.data(), raw.size(), kLevel);
  if (ZSTD_isError(size)) throw std::bad_alloc();  // nothing else can go wrong
  packed_.resize(size);
  packed_.shrink_to_fit();
}

std::optional<StoredView> StoredView::from_parts(const Pinhole& camera,
                                                 std::vector<SceneObjectId> objects,
                                                 std::string packed) {
  const auto pixels = static_cast<unsigned long long>(camera.width) *
                      static_cast<unsigned long long>(camera.height);
  if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != kPlanes * pixels)
    return std::nullopt;
  std::string raw(kPlanes * pixels, '\0');
  if (ZSTD_decompress(raw.data(), raw.size(), packed.data(), packed.size()) != raw.size())
    return std::nullopt;
  StoredView view;
  view.camera_ = camera;
  view.objects_ = std::move(objects);
  view.packed_ = std::move(packed);
  for (const std::uint8_t object : view.restored().object)
    if (DepthView::is_thing(object) && object > view.objects_.size()) return std::nullopt;
  return view;
}

DepthView StoredView::restored() const {
  DepthView view;
  view.camera = camera_;
  view.objects = objects_;
  view.depth = Image<std::uint16_t>(camera_.width, camera_.height);
  view.colour = ColourImage(camera_.width, camera_.height);
  view.object = Image<std::uint8_t>(camera_.width, camera_.height);
  const std::size_t pixels = view.depth.size();
  std::string raw(kPlanes * pixels, '\0');
  const std::size_t size = ZSTD_decompress(raw.data(), raw.size(), packed_.data(), packed_.size());
  if (ZSTD_isError(size)) throw std::bad_alloc();
  CHECK(size == raw.size());
  std::uint16_t before = 0;
  const auto depth = view.depth.begin();
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto low = static_cast<std::uint8_t>(raw[i]);
    const auto high = static_cast<std::uint8_t>(raw[pixels + i]);
    before = depth[i] = static_cast<std::uint16_t>(before + (low | high << 8));
  }
  for (int plane = 2; plane < kPlanes; ++plane)
    from_differences(raw.data() + plane * pixels, pixels);
  const auto byte = [&](std::size_t plane, std::size_t i) {
    return static_cast<std::uint8_t>(raw[plane * pixels + i]);
  };
  for (std::size_t i = 0; i < pixels; ++i) {
    view.colour.begin()[i] = {byte(2, i), byte(3, i), byte(4, i)};
    view.object.begin()[i] = byte(5, i);
  }
  return view;
}

}  // namespace ygslam
