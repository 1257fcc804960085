#include "dense/stored_view.hpp"

#include <zstd.h>

#include <memory>
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

/// The bytes before compression: planes of a byte for each pixel, which hold differences to the
/// pixel before (neighbours are alike, so they compress well). A depth is differenced as a whole,
/// then split into a low and a high byte.
struct Planes {
  std::size_t pixels;
  char* raw;
  [[nodiscard]] char* plane(std::size_t i) const { return raw + i * pixels; }
};

char difference(std::uint8_t now, std::uint8_t& before) {
  return static_cast<char>(now - std::exchange(before, now));
}
std::uint8_t undo_difference(char difference, std::uint8_t& before) {
  return before = static_cast<std::uint8_t>(before + difference);
}

}  // namespace

StoredView::StoredView(DepthView& view) : camera_(view.camera), objects_(view.objects) {
  for (Rgb8& colour : view.colour)
    colour = {coarse(colour.r, 5), coarse(colour.g, 6), coarse(colour.b, 5)};
  const std::size_t pixels = view.depth.size();
  std::string raw(kPlanes * pixels, '\0');
  const Planes to{pixels, raw.data()};
  const auto depth = view.depth.begin();
  std::uint16_t depth_before = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto step = static_cast<std::uint16_t>(depth[i] - std::exchange(depth_before, depth[i]));
    to.plane(0)[i] = static_cast<char>(step & 0xff);
    to.plane(1)[i] = static_cast<char>(step >> 8);
  }
  const auto colour = view.colour.begin();
  Rgb8 before;
  for (std::size_t i = 0; i < pixels; ++i) {
    to.plane(2)[i] = difference(colour[i].r, before.r);
    to.plane(3)[i] = difference(colour[i].g, before.g);
    to.plane(4)[i] = difference(colour[i].b, before.b);
  }
  const auto object = view.object.begin();
  std::uint8_t object_before = 0;
  for (std::size_t i = 0; i < pixels; ++i) to.plane(5)[i] = difference(object[i], object_before);
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
    if (DepthView::is_object(object) && object > view.objects_.size()) return std::nullopt;
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
  const auto raw = std::make_unique_for_overwrite<char[]>(kPlanes * pixels);
  const std::size_t size =
      ZSTD_decompress(raw.get(), kPlanes * pixels, packed_.data(), packed_.size());
  if (ZSTD_isError(size)) throw std::bad_alloc();
  CHECK(size == kPlanes * pixels);
  const Planes from{pixels, raw.get()};
  const auto depth = view.depth.begin();
  std::uint16_t depth_before = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto low = static_cast<std::uint8_t>(from.plane(0)[i]);
    const auto high = static_cast<std::uint8_t>(from.plane(1)[i]);
    depth_before = depth[i] = static_cast<std::uint16_t>(depth_before + (low | high << 8));
  }
  const auto colour = view.colour.begin();
  Rgb8 before;
  for (std::size_t i = 0; i < pixels; ++i)
    colour[i] = {undo_difference(from.plane(2)[i], before.r),
                 undo_difference(from.plane(3)[i], before.g),
                 undo_difference(from.plane(4)[i], before.b)};
  const auto object = view.object.begin();
  std::uint8_t object_before = 0;
  for (std::size_t i = 0; i < pixels; ++i)
    object[i] = undo_difference(from.plane(5)[i], object_before);
  return view;
}

}  // namespace ygslam
