// The toy networks' own implementation; linked into the tests only.
#include "segment/toy_networks.hpp"

#include <openvino/core/model.hpp>
#include <openvino/opsets/opset9.hpp>

namespace ygslam::testing {
namespace {

namespace op9 = ov::opset9;
using ToyNode = ov::Output<ov::Node>;

constexpr int kPersonClasses = 80;

template <typename Op, typename... Arguments>
ToyNode make(Arguments&&... arguments) {
  return std::make_shared<Op>(std::forward<Arguments>(arguments)...)->output(0);
}
ToyNode numbers(const ov::Shape& shape, const std::vector<float>& values) {
  return op9::Constant::create(ov::element::f32, shape, values)->output(0);
}
ToyNode integers(const ov::Shape& shape, const std::vector<std::int64_t>& values) {
  return op9::Constant::create(ov::element::i64, shape, values)->output(0);
}
ToyNode integer(std::int64_t value) { return integers({}, {value}); }
ToyNode gather(const ToyNode& data, const ToyNode& indices, std::int64_t axis) {
  return make<op9::Gather>(data, indices, integer(axis));
}
ToyNode unsqueeze(const ToyNode& data, std::int64_t axis) {
  return make<op9::Unsqueeze>(data, integer(axis));
}
ToyNode concat(const ToyNode& a, const ToyNode& b, std::int64_t axis) {
  return make<op9::Concat>(ov::OutputVector{a, b}, axis);
}

std::shared_ptr<op9::Parameter> image_input(const ToyNetwork& toy) {
  return std::make_shared<op9::Parameter>(ov::element::f32,
                                          ov::PartialShape{1, 3, toy.height, toy.width});
}

/// 1x1xHxW: 10 where the image has the toys' colour, -10 where it is far from it.
/// @param mean, deviation of red, green, blue; @param planes where in the input each is.
ToyNode colour_logits(const ToyNode& image, const std::vector<float>& mean,
                      const std::vector<float>& deviation, const std::vector<int>& planes) {
  std::vector<float> weights(9, 0.0F);
  for (std::size_t c = 0; c < 3; ++c) weights[3 * c + planes[c]] = deviation[c];
  const std::vector<float> colour{kToyColour.r, kToyColour.g, kToyColour.b};
  std::vector<float> offset;
  for (std::size_t c = 0; c < 3; ++c) offset.push_back(mean[c] - colour[c]);
  const ToyNode bytes =
      make<op9::Convolution>(image, numbers({3, 3, 1, 1}, weights), ov::Strides{1, 1},
                             ov::CoordinateDiff{0, 0}, ov::CoordinateDiff{0, 0}, ov::Strides{1, 1});
  const ToyNode difference = make<op9::Abs>(make<op9::Add>(bytes, numbers({1, 3, 1, 1}, offset)));
  const ToyNode sum = make<op9::ReduceSum>(difference, integers({1}, {1}), true);
  return make<op9::Subtract>(numbers({1, 1, 1, 1}, {10}), make<op9::Clamp>(sum, 0.0, 20.0));
}

ToyNode quarter_size(const ToyNode& plane) {
  return make<op9::AvgPool>(plane, ov::Strides{4, 4}, ov::Shape{0, 0}, ov::Shape{0, 0},
                            ov::Shape{4, 4}, true);
}

/// A constant that the compiler cannot take out of the network: 0 times the image's mean is added.
ToyNode not_constant(const ToyNode& constant, const ToyNode& image) {
  const ToyNode mean = make<op9::ReduceMean>(image, integers({4}, {0, 1, 2, 3}), false);
  return make<op9::Add>(constant, make<op9::Multiply>(mean, numbers({}, {0})));
}

std::shared_ptr<ov::Model> finish(const ToyNetwork& toy, ToyNode boxes, ToyNode labels,
                                  ToyNode masks, const std::shared_ptr<op9::Parameter>& image) {
  if (toy.is_named) {
    boxes.set_names({"dets"});
    labels.set_names({"labels"});
    masks.set_names({"masks"});
  }
  const ov::OutputVector usual{boxes, labels, masks};
  const ov::OutputVector other{masks, boxes, labels};
  return std::make_shared<ov::Model>(toy.masks_first ? other : usual, ov::ParameterVector{image});
}

const std::vector<float> kImageNetMean{123.675F, 116.28F, 103.53F};
const std::vector<float> kImageNetStd{58.395F, 57.12F, 57.375F};

}  // namespace

std::shared_ptr<ov::Model> make_yolo_end_toy(const ToyNetwork& toy) {
  constexpr std::size_t kValues = 6 + 32;
  const auto rows = static_cast<std::size_t>(toy.rows);
  std::vector<float> values(rows * kValues, 0.0F);
  for (std::size_t i = 0; i < toy.detections.size(); ++i) {
    const ToyDetection& d = toy.detections[i];
    const std::vector<float> row{d.x0, d.y0, d.x1, d.y1, d.score, static_cast<float>(d.label), 1};
    std::copy(row.begin(), row.end(), values.begin() + static_cast<std::ptrdiff_t>(i * kValues));
  }
  const auto image = image_input(toy);
  const ToyNode logits = quarter_size(colour_logits(image, {0, 0, 0}, {255, 255, 255}, {0, 1, 2}));
  std::vector<float> only_first(32, 0.0F);
  only_first[0] = 1;
  const ToyNode prototypes = make<op9::Multiply>(logits, numbers({1, 32, 1, 1}, only_first));
  const ToyNode detections = not_constant(numbers({1, rows, kValues}, values), image);
  return std::make_shared<ov::Model>(ov::OutputVector{detections, prototypes},
                                     ov::ParameterVector{image});
}

std::shared_ptr<ov::Model> make_rtmdet_toy(const ToyNetwork& toy) {
  const std::size_t n = toy.detections.size();
  std::vector<float> corners, best, scores(kPersonClasses * n, 0.0F);
  for (std::size_t i = 0; i < n; ++i) {
    const ToyDetection& d = toy.detections[i];
    corners.insert(corners.end(), {d.x0, d.y0, d.x1, d.y1});
    best.push_back(d.score);
    scores[static_cast<std::size_t>(d.label) * n + i] = d.score;
  }
  const auto image = image_input(toy);
  const ToyNode boxes = numbers({1, n, 4}, corners);
  const ToyNode selected = make<op9::NonMaxSuppression>(
      boxes, not_constant(numbers({1, kPersonClasses, n}, scores), image), integer(100),
      numbers({}, {0.65F}), numbers({}, {0.05F}), op9::NonMaxSuppression::BoxEncodingType::CORNER,
      false, ov::element::i64);
  const ToyNode classes = gather(selected, integer(1), 1);
  const ToyNode kept = gather(selected, integer(2), 1);

  const ToyNode rows = concat(gather(numbers({n, 4}, corners), kept, 0),
                              unsqueeze(gather(numbers({n}, best), kept, 0), 1), 1);
  ToyNode dets = concat(unsqueeze(rows, 0), numbers({1, 1, 5}, std::vector<float>(5, 0.0F)), 1);
  ToyNode labels = concat(unsqueeze(classes, 0), integers({1, 1}, {0}), 1);
  const ToyNode count = gather(make<op9::ShapeOf>(dets, ov::element::i64), integer(1), 0);
  const auto sorted = std::make_shared<op9::TopK>(
      gather(dets, integer(4), 2), make<op9::Minimum>(count, integer(100)), 1, op9::TopK::Mode::MAX,
      op9::TopK::SortType::SORT_VALUES, ov::element::i64);
  const ToyNode order = make<op9::Squeeze>(sorted->output(1), integers({1}, {0}));
  dets = gather(dets, order, 1);
  labels = gather(labels, order, 1);

  const ToyNode without_padding = make<op9::Slice>(order, integers({1}, {0}), integers({1}, {-1}),
                                                   integers({1}, {1}), integers({1}, {0}));
  const ToyNode ones =
      gather(numbers({n}, std::vector<float>(n, 1.0F)), gather(kept, without_padding, 0), 0);
  const ToyNode each = unsqueeze(unsqueeze(unsqueeze(ones, 0), 2), 3);
  const ToyNode logits = colour_logits(image, kImageNetMean, kImageNetStd, {2, 1, 0});
  const ToyNode masks = make<op9::Sigmoid>(make<op9::Multiply>(each, logits));
  return finish(toy, dets, labels, masks, image);
}

std::shared_ptr<ov::Model> make_rfdetr_toy(const ToyNetwork& toy) {
  const auto rows = static_cast<std::size_t>(toy.rows);
  const auto classes = static_cast<std::size_t>(toy.classes);
  std::vector<float> boxes(rows * 4, 0.5F), logits(rows * classes, -8.0F);
  for (std::size_t i = 0; i < toy.detections.size(); ++i) {
    const ToyDetection& d = toy.detections[i];
    const auto width = static_cast<float>(toy.width);
    const auto height = static_cast<float>(toy.height);
    const std::vector<float> box{(d.x0 + d.x1) / 2 / width, (d.y0 + d.y1) / 2 / height,
                                 (d.x1 - d.x0) / width, (d.y1 - d.y0) / height};
    std::copy(box.begin(), box.end(), boxes.begin() + static_cast<std::ptrdiff_t>(4 * i));
    logits[i * classes + static_cast<std::size_t>(d.label)] = std::log(d.score / (1 - d.score));
  }
  const auto image = image_input(toy);
  const ToyNode plane = quarter_size(colour_logits(image, kImageNetMean, kImageNetStd, {0, 1, 2}));
  const ToyNode masks =
      make<op9::Multiply>(numbers({1, rows, 1, 1}, std::vector<float>(rows, 1.0F)), plane);
  return finish(toy, not_constant(numbers({1, rows, 4}, boxes), image),
                not_constant(numbers({1, rows, classes}, logits), image), masks, image);
}

}  // namespace ygslam::testing
