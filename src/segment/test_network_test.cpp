// The test networks' own implementation; linked into the tests only.
#include "segment/test_network.hpp"

#include <cstring>
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

/// Of a protocol buffer: https://protobuf.dev/programming-guides/encoding
std::string varint(std::uint64_t value) {
  std::string bytes;
  for (; value > 127; value >>= 7) bytes += static_cast<char>((value & 127) | 128);
  return bytes + static_cast<char>(value);
}
std::string number(unsigned field, std::uint64_t value) {
  return varint(field << 3) + varint(value);
}
std::string bytes(unsigned field, const std::string& payload) {
  return varint(field << 3 | 2) + varint(payload.size()) + payload;
}

/// A ValueInfoProto of onnx.proto: 32-bit floats.
std::string onnx_value(const std::string& name, const std::vector<int>& shape) {
  std::string dims;
  for (const int size : shape) dims += bytes(1, number(1, static_cast<std::uint64_t>(size)));
  return bytes(1, name) + bytes(2, bytes(1, number(1, 1) + bytes(2, dims)));
}

/// A TensorProto of 32-bit floats.
std::string onnx_tensor(const std::string& name, const std::vector<int>& shape,
                        const std::vector<float>& values) {
  std::string dims;
  for (const int size : shape) dims += number(1, static_cast<std::uint64_t>(size));
  std::string raw(values.size() * sizeof(float), '\0');
  std::memcpy(raw.data(), values.data(), raw.size());
  return dims + number(2, 1) + bytes(8, name) + bytes(9, raw);
}

}  // namespace

std::string yolo_onnx(const std::string& names) {
  constexpr std::size_t kCells = 21, kChannels = 4 + 3 + 32, kPlane = 64;
  std::vector<float> detections(kChannels * kCells, 0.0F), prototypes(32 * kPlane, 0.0F);
  const std::vector<std::pair<std::size_t, float>> first_cell{{0, 16.0F}, {1, 16.0F}, {2, 20.0F},
                                                              {3, 20.0F}, {5, 0.9F},  {7, 1.0F}};
  for (const auto& [channel, value] : first_cell) detections[channel * kCells] = value;
  std::fill_n(prototypes.begin(), kPlane, 1.0F);
  const auto copy = [](const char* from, const char* to) {
    return bytes(1, bytes(1, from) + bytes(2, to) + bytes(4, "Identity"));
  };
  const std::string graph = copy("d", "output0") + copy("p", "output1") + bytes(2, "g") +
                            bytes(5, onnx_tensor("d", {1, kChannels, kCells}, detections)) +
                            bytes(5, onnx_tensor("p", {1, 32, 8, 8}, prototypes)) +
                            bytes(11, onnx_value("images", {1, 3, 32, 32})) +
                            bytes(12, onnx_value("output0", {1, kChannels, kCells})) +
                            bytes(12, onnx_value("output1", {1, 32, 8, 8}));
  const std::string metadata = names.empty() ? "" : bytes(14, bytes(1, "names") + bytes(2, names));
  return number(1, 8) + bytes(7, graph) + bytes(8, bytes(1, "") + number(2, 17)) + metadata;
}

std::string people_onnx(float weight, int channels) {
  constexpr int kMeasured = 1;
  std::vector<float> weights(static_cast<std::size_t>(channels), 0.0F);
  weights[std::min(kMeasured, channels - 1)] = weight;
  const std::string tensor = onnx_tensor("w", {1, channels, 1, 1}, weights);
  const std::string node =
      bytes(1, "cells") + bytes(1, "w") + bytes(2, "people") + bytes(4, "Conv");
  const std::string graph = bytes(1, node) + bytes(2, "g") + bytes(5, tensor) +
                            bytes(11, onnx_value("cells", {1, channels, 120, 160})) +
                            bytes(12, onnx_value("people", {1, 1, 120, 160}));
  return number(1, 8) + bytes(7, graph) + bytes(8, bytes(1, "") + number(2, 17));
}

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
