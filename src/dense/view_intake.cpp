#include "dense/view_intake.hpp"

#include <algorithm>
#include <utility>

#include "core/check.hpp"
#include "dense/mask_depth.hpp"
#include "dense/round_objects.hpp"

namespace ygslam {
namespace {

/// Movers with a margin, but where an object is that moves: its own pixels say where that is.
GreyImage excluded_pixels(const DenseFrame& frame, const std::vector<bool>& is_moving,
                          int margin_px) {
  GreyImage excluded = dilated(frame.movers, margin_px);
  for (std::size_t i = 0; i < excluded.size() && !frame.things.empty(); ++i) {
    const std::uint8_t number = frame.things.begin()[i];
    if (number > 0 && is_moving[number - 1U]) excluded.begin()[i] = 0;
  }
  return excluded;
}

/// Of detections, from 1; near the edge of a mask it is not sure what a pixel shows.
Image<SceneObjectId> numbers_of_pixels(const DenseFrame& frame) {
  const GreyImage inner = without_edges(frame.things, frame.edge_px);
  Image<SceneObjectId> numbers(inner.width(), inner.height());
  std::transform(frame.things.begin(), frame.things.end(), inner.begin(), numbers.begin(),
                 [](std::uint8_t number, std::uint8_t kept) {
                   return number != kept ? kUnsureObject : SceneObjectId{kept};
                 });
  return numbers;
}

}  // namespace

IncomingView incoming_view(const DenseFrame& frame, const DenseMapConfig& config,
                           const Camera& camera) {
  CHECK(frame.detections.size() <= kMaxDetections);
  const PreparationConfig& preparation = config.volume.preparation;
  const std::vector<bool> is_moving =
      moving_detections(frame.things, frame.movers, frame.detections.size(), frame.motion_votes);
  const Image<SceneObjectId> numbers = numbers_of_pixels(frame);
  const GreyImage excluded = excluded_pixels(frame, is_moving, config.margin_px);
  IncomingView view{make_depth_view({frame.frame->depth_m, frame.frame->colour, numbers, excluded},
                                    camera, frame.read_out),
                    {}};
  drop_what_lies_elsewhere(view.images, preparation);
  drop_beyond_round_objects(view.images, frame.detections, preparation.noise);
  view.observations = observe_objects(view.images, frame.detections, preparation.max_depth_m);
  std::vector<bool> is_excluded;
  for (const SceneObjectId number : view.images.objects) {
    const std::size_t i = static_cast<std::size_t>(number) - 1;
    is_excluded.push_back(is_moving[i]);
    view.observations[i].is_moving = is_moving[i];
  }
  exclude_objects(view.images, is_excluded, config.margin_px);
  return view;
}

}  // namespace ygslam
