// The test network's own implementation; linked into the tests only.
#include "segment/test_network.hpp"

#include <openvino/core/model.hpp>
#include <openvino/opsets/opset8.hpp>
#include <openvino/pass/serialize.hpp>

namespace ygslam::testing {
namespace {

namespace op = ov::opset8;
using Node = std::shared_ptr<ov::Node>;

Node floats(const ov::Shape& shape, const std::vector<float>& values) {
  return op::Constant::create(ov::element::f32, shape, values);
}
Node ints(const std::vector<std::int64_t>& values) {
  return op::Constant::create(ov::element::i64, {values.size()}, values);
}

Node convolve(const Node& input, std::size_t stride, const ov::Shape& shape,
              const std::vector<float>& weights) {
  return std::make_shared<op::Convolution>(input, floats(shape, weights),
                                           ov::Strides{stride, stride}, ov::CoordinateDiff{0, 0},
                                           ov::CoordinateDiff{0, 0}, ov::Strides{1, 1});
}

/// channels x (cells of one stride): `values` at every cell, whatever the image.
Node constant_detections(const Node& image, std::size_t stride, const std::vector<float>& values) {
  const std::size_t channels = values.size();
  const Node zeros = convolve(image, stride, {channels, 3, stride, stride},
                              std::vector<float>(channels * 3 * stride * stride, 0.0F));
  const Node filled = std::make_shared<op::Add>(zeros, floats({1, channels, 1, 1}, values));
  return std::make_shared<op::Reshape>(filled, ints({1, static_cast<std::int64_t>(channels), -1}),
                                       false);
}

}  // namespace

std::shared_ptr<ov::Model> make_test_network(const TestNetwork& shape) {
  const auto side = [](int size) { return size == 0 ? ov::Dimension() : ov::Dimension(size); };
  auto images = std::make_shared<op::Parameter>(
      ov::element::f32, ov::PartialShape{1, 3, side(shape.height), side(shape.width)});
  Node input = images;
  if (shape.quantised) {
    input = std::make_shared<op::FakeQuantize>(input, floats({1}, {0}), floats({1}, {1}),
                                               floats({1}, {0}), floats({1}, {1}), 256);
  }
  std::vector<float> detection(shape.channels, 0.0F);
  detection[2] = detection[3] = 10000.0F;
  detection[4] = shape.score;
  if (shape.channels > 84) detection[84] = 1.0F;
  ov::OutputVector strides;
  for (const std::size_t stride : {8, 16, 32}) {
    strides.push_back(constant_detections(input, stride, detection));
  }
  const Node boxes = std::make_shared<op::Concat>(strides, 2);

  const auto count = static_cast<std::size_t>(shape.prototypes);
  std::vector<float> mean_red(count * 3 * 16, 0.0F);
  std::fill(mean_red.begin(), mean_red.begin() + 16, 1.0F / 16.0F);
  const Node masks = std::make_shared<op::Subtract>(convolve(input, 4, {count, 3, 4, 4}, mean_red),
                                                    floats({1, 1, 1, 1}, {0.5F}));
  return std::make_shared<ov::Model>(ov::OutputVector{boxes, masks}, ov::ParameterVector{images});
}

void write_network(const std::shared_ptr<ov::Model>& network, const std::filesystem::path& file) {
  ov::pass::Serialize(file.string(), std::filesystem::path(file).replace_extension("bin").string())
      .run_on_model(network);
}

}  // namespace ygslam::testing
