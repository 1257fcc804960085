#include "segment/yolo_model.hpp"

#include <algorithm>
#include <openvino/core/preprocess/pre_post_process.hpp>
#include <openvino/runtime/core.hpp>
#include <sstream>

#include "core/memory.hpp"
#include "segment/openvino_network.hpp"
#include "segment/yolo_decode.hpp"

namespace ygslam {
namespace {

constexpr int kMaxSide = 2048;                        // of the input [px]
constexpr std::uint64_t kMaxElements = 1ULL << 28;    // of any tensor inside
constexpr std::uintmax_t kMaxFileBytes = 1ULL << 30;  // two hundred times the nano network

Error fault(const std::filesystem::path& file, const std::string& what) {
  return {ErrorKind::kModel, file.string() + ": " + what};
}

std::string text(const ov::PartialShape& shape) {
  std::ostringstream out;
  out << shape;
  return out.str();
}

Status check_file(const std::filesystem::path& file) {
  std::error_code ec;
  const auto status = std::filesystem::status(file, ec);
  if (!std::filesystem::exists(status)) return fault(file, "no such model file");
  if (!std::filesystem::is_regular_file(status)) return fault(file, "is not a file");
  // Left to itself OpenVINO tries every format it knows on a file it cannot place.
  if (file.extension() != ".onnx" && file.extension() != ".xml") {
    return fault(file, "is neither .onnx nor .xml (make model exports .onnx)");
  }
  const auto size = std::filesystem::file_size(file, ec);
  if (ec || size == 0) return fault(file, "empty model file");
  if (size > kMaxFileBytes) return fault(file, "too large for a YOLOv8-seg model");
  return Ok{};
}

/// Fixes the input to 1 x 3 x height x width. @return the size, or why it is not an image input.
Result<YoloLayout> fix_input(ov::Model& network, const std::filesystem::path& file, int width,
                             int height) {
  if (network.inputs().size() != 1 || network.outputs().size() != 2) {
    return fault(file, "has " + std::to_string(network.inputs().size()) + " inputs and " +
                           std::to_string(network.outputs().size()) +
                           " outputs, a YOLOv8-seg export has 1 and 2");
  }
  const ov::PartialShape shape = network.input().get_partial_shape();
  const ov::PartialShape image{-1, 3, -1, -1};
  if (shape.rank().is_dynamic() || shape.size() != 4 || !shape.compatible(image) ||
      !shape[0].compatible(1)) {
    return fault(file, "input shape " + text(shape) + ", expected [1,3,height,width]");
  }
  const auto side = [](const ov::Dimension& d, int open) {
    return d.is_static() ? d.get_length() : std::int64_t{open};
  };
  const std::int64_t h = side(shape[2], height);
  const std::int64_t w = side(shape[3], width);
  if (std::min(h, w) < 32 || std::max(h, w) > kMaxSide || h % 32 != 0 || w % 32 != 0) {
    return fault(file, "input of " + std::to_string(w) + "x" + std::to_string(h) +
                           " px, expected multiples of 32 up to " + std::to_string(kMaxSide));
  }
  if (shape.is_dynamic()) network.reshape(ov::PartialShape{1, 3, h, w});
  return standard_layout(static_cast<int>(w), static_cast<int>(h));
}

Status check_outputs(const ov::Model& network, const std::filesystem::path& file,
                     YoloLayout& layout) {
  const ov::PartialShape boxes{1, kYoloChannels, layout.cells};
  const ov::PartialShape prototypes{1, kYoloCoefficients, layout.proto_height, layout.proto_width};
  const ov::PartialShape first = network.output(0).get_partial_shape();
  const ov::PartialShape second = network.output(1).get_partial_shape();
  layout.boxes_first = first == boxes && second == prototypes;
  if (layout.boxes_first || (first == prototypes && second == boxes)) return Ok{};
  return fault(file, "output shapes " + text(first) + " and " + text(second) + ", a YOLOv8-seg " +
                         "export with 80 classes has " + text(boxes) + " and " + text(prototypes));
}

/// A small file can ask for terabytes.
Status check_tensors(const ov::Model& network, const std::filesystem::path& file) {
  for (const auto& op : network.get_ops()) {
    for (const auto& output : op->outputs()) {
      const ov::PartialShape& shape = output.get_partial_shape();
      if (shape.is_dynamic()) continue;
      std::uint64_t elements = 1;
      for (const std::size_t d : shape.to_shape()) {
        if (d != 0 && elements > kMaxElements / d) {
          return fault(file, "tensor of shape " + text(shape) + " inside, too large");
        }
        elements *= d;
      }
    }
  }
  return Ok{};
}

std::shared_ptr<ov::Model> with_float_borders(const std::shared_ptr<ov::Model>& network) {
  const auto is_f32 = [](const auto& port) { return port.get_element_type() == ov::element::f32; };
  const auto outputs = network->outputs();
  if (is_f32(network->input()) && std::all_of(outputs.begin(), outputs.end(), is_f32)) {
    return network;
  }
  ov::preprocess::PrePostProcessor borders(network);
  borders.input().tensor().set_element_type(ov::element::f32);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    borders.output(i).tensor().set_element_type(ov::element::f32);
  }
  return borders.build();
}

}  // namespace

YoloLayout standard_layout(int width, int height) {
  YoloLayout layout{width, height};
  for (const int stride : {8, 16, 32}) layout.cells += (width / stride) * (height / stride);
  layout.proto_width = width / 4;
  layout.proto_height = height / 4;
  return layout;
}

Result<YoloModel> read_yolo_model(const std::filesystem::path& file, int width, int height) {
  if (const Status readable = check_file(file); !readable.ok()) return readable.error();
  try {
    YoloModel model{ov::Core().read_model(file), {}};
    const auto layout = fix_input(*model.network, file, width, height);
    if (!layout.ok()) return layout.error();
    model.layout = layout.value();
    if (const Status ok = check_outputs(*model.network, file, model.layout); !ok.ok()) {
      return ok.error();
    }
    if (const Status ok = check_tensors(*model.network, file); !ok.ok()) return ok.error();
    model.layout.quantised = is_quantised(*model.network);
    model.network = with_float_borders(model.network);
    return model;
  } catch (const std::exception& e) {
    require_memory(kAmpleMemory_bytes);
    return fault(file, "cannot be read as a network: " + fault_in(e.what()));
  }
}

}  // namespace ygslam
