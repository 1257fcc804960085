#include "segment/model_file.hpp"

#include <algorithm>
#include <openvino/core/preprocess/pre_post_process.hpp>
#include <openvino/runtime/core.hpp>
#include <sstream>

#include "core/memory.hpp"
#include "segment/network_input.hpp"
#include "segment/openvino_network.hpp"

namespace ygslam {
namespace {

constexpr int kMaxSide = 2048;                        // of the input [px]
constexpr std::uint64_t kMaxElements = 1ULL << 28;    // of any tensor inside
constexpr std::uintmax_t kMaxFileBytes = 1ULL << 30;  // two hundred times YOLOv8n-seg
constexpr int kMinSide = 32;                          // of the input [px]

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
  if (size > kMaxFileBytes) return fault(file, "too large for a segmentation model");
  return Ok{};
}

struct InputSize {
  int width = 0, height = 0;
};

/// Fixes the input to 1 x 3 x height x width. @return the size, or why it is not an image input.
Result<InputSize> fix_input(ov::Model& network, int width, int height) {
  const auto no = [](const std::string& why) { return Error{ErrorKind::kModel, why}; };
  if (network.inputs().size() != 1)
    return no("has " + std::to_string(network.inputs().size()) + " inputs, expected one image");
  const ov::PartialShape shape = network.input().get_partial_shape();
  const ov::PartialShape image{-1, 3, -1, -1};
  if (shape.rank().is_dynamic() || shape.size() != 4 || !shape.compatible(image) ||
      !shape[0].compatible(1)) {
    return no("input shape " + text(shape) + ", expected [1,3,height,width]");
  }
  const auto side = [](const ov::Dimension& d, int open) {
    return d.is_static() ? d.get_length() : std::int64_t{open};
  };
  const std::int64_t h = side(shape[2], height);
  const std::int64_t w = side(shape[3], width);
  if (std::min(h, w) < kMinSide || std::max(h, w) > kMaxSide) {
    return no("input of " + std::to_string(w) + "x" + std::to_string(h) + " px, expected " +
              std::to_string(kMinSide) + " to " + std::to_string(kMaxSide));
  }
  if (shape.is_dynamic()) network.reshape(ov::PartialShape{1, 3, h, w});
  return InputSize{static_cast<int>(w), static_cast<int>(h)};
}

std::vector<OutputShape> shapes_of(const ov::Model& network) {
  std::vector<OutputShape> shapes;
  for (const auto& output : network.outputs()) {
    const auto& names = output.get_names();
    OutputShape shape{names.empty() ? "" : output.get_any_name(), {}};
    const ov::PartialShape& lengths = output.get_partial_shape();
    if (lengths.rank().is_static()) {
      for (const ov::Dimension& d : lengths)
        shape.lengths.push_back(d.is_static() ? d.get_length() : kOpen);
    }
    shapes.push_back(std::move(shape));
  }
  return shapes;
}

/// What the exporters wrote into the file beside the network.
ClassNames class_names_of(const ov::Model& network) {
  const auto text_at = [&](const char* key) -> std::string {
    // Where OpenVINO puts an ONNX file's metadata, and Ultralytics' OpenVINO export its own.
    for (const char* section : {"framework", "model_info"}) {
      if (network.has_rt_info(section, key) &&
          network.get_rt_info<ov::Any>(section, key).is<std::string>())
        return network.get_rt_info<std::string>(section, key);
    }
    return {};
  };
  const ClassNames names = parse_python_names(text_at("names"));
  return names.empty() ? parse_rfdetr_names(text_at("rfdetr_inference")) : names;
}

/// A small file can ask for terabytes.
Status check_tensors(const ov::Model& network) {
  for (const auto& op : network.get_ops()) {
    for (const auto& output : op->outputs()) {
      const ov::PartialShape& shape = output.get_partial_shape();
      if (shape.is_dynamic()) continue;
      std::uint64_t elements = 1;
      for (const std::size_t d : shape.to_shape()) {
        if (d != 0 && elements > kMaxElements / d) {
          return Error{ErrorKind::kModel, "tensor of shape " + text(shape) + " inside, too large"};
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

Result<ModelFile> examine(const std::shared_ptr<ov::Model>& network, int width, int height) {
  const auto size = fix_input(*network, width, height);
  if (!size.ok()) return size.error();
  const auto layout =
      recognise_outputs(shapes_of(*network), size->width, size->height, class_names_of(*network));
  if (!layout.ok()) return layout.error();
  const int multiple = input_form(layout->kind).multiple_px;
  if (size->width % multiple != 0 || size->height % multiple != 0) {
    return Error{ErrorKind::kModel, "input of " + std::to_string(size->width) + "x" +
                                        std::to_string(size->height) +
                                        " px, expected multiples of " + std::to_string(multiple)};
  }
  if (const Status ok = check_tensors(*network); !ok.ok()) return ok.error();
  return ModelFile{with_float_borders(network), *layout, size->width, size->height,
                   is_quantised(*network)};
}

}  // namespace

Result<ModelFile> read_model_file(const std::filesystem::path& file, int width, int height) {
  if (const Status readable = check_file(file); !readable.ok()) return readable.error();
  try {
    auto model = examine(ov::Core().read_model(file), width, height);
    if (!model.ok()) return fault(file, model.error().message);
    return model;
  } catch (const std::exception& e) {
    require_memory(kAmpleMemory_bytes);
    return fault(file, "cannot be read as a network: " + fault_in(e.what()));
  }
}

}  // namespace ygslam
