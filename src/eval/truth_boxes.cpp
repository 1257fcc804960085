#include "eval/truth_boxes.hpp"

#include "core/check.hpp"

namespace ygslam {
namespace {

constexpr double kMovingShare = 0.1;  // of its visible pixels: it moves

template <typename Visible>
std::array<Visible, 256> visible_things(const DynamicTruth& truth) {
  std::array<Visible, 256> things;
  for (int v = 0; v < truth.ids.height(); ++v) {
    for (int u = 0; u < truth.ids.width(); ++u) {
      const std::uint8_t id = truth.ids.at(u, v);
      if (id == 0) continue;
      const PixelBox pixel{static_cast<float>(u), static_cast<float>(v), static_cast<float>(u + 1),
                           static_cast<float>(v + 1)};
      Visible& thing = things[id];
      thing.box = thing.pixels == 0 ? pixel : (thing.box | pixel);
      ++thing.pixels;
      thing.moving += truth.moving.empty() || truth.moving.at(u, v) > 0 ? 1 : 0;
    }
  }
  return things;
}

}  // namespace

/// Whether it touches a person in the image: then it may count as part of the person.
bool TruthBoxes::is_held(std::size_t id, const std::array<Visible, 256>& things) const {
  for (std::size_t other = 1; other < things.size(); ++other)
    if (movable_[other] && things[other].pixels > 0 &&
        !(things[other].box & things[id].box).empty())
      return true;
  return false;
}

std::vector<IdBox> TruthBoxes::step(Timestamp stamp, const DynamicTruth& truth) {
  CHECK(truth.moving.empty() || truth.moving.same_size(truth.ids));
  const auto things = visible_things<Visible>(truth);
  std::vector<IdBox> boxes;
  for (std::size_t id = 1; id < things.size(); ++id) {
    const Visible& thing = things[id];
    if (thing.pixels == 0) continue;
    if (static_cast<double>(thing.moving) >= kMovingShare * static_cast<double>(thing.pixels))
      moved_[id] = stamp;
    const bool moves = moved_[id] && seconds_between(stamp, *moved_[id]) <= kMovedLately_s;
    const bool wanted = movable_[id] || (moves && !is_held(id, things));
    boxes.push_back({static_cast<int>(id), thing.box, wanted && thing.pixels >= kLeastVisible_px});
  }
  return boxes;
}

}  // namespace ygslam
