#include "segment/model_segmenter.hpp"

#include <algorithm>
#include <cmath>
#include <openvino/runtime/core.hpp>

#include "core/memory.hpp"
#include "core/trace.hpp"
#include "segment/embedded_network.hpp"
#include "segment/file_weights.hpp"
#include "segment/model_file.hpp"
#include "segment/model_probe.hpp"
#include "segment/network_input.hpp"
#include "segment/openvino_network.hpp"
#include "segment/output_decode.hpp"
#include "segment/people_network.hpp"

namespace ygslam {
namespace {

// With less OpenVINO may crash. YOLOv8n-seg takes some 150 MB.
constexpr std::size_t kLeastMemory_bytes = std::size_t{128} << 20;

class ModelSegmenter final : public Segmenter {
 public:
  ModelSegmenter(ov::InferRequest request, const ModelFile& model, DecodeConfig decode,
                 std::string precision)
      : request_(std::move(request)),
        layout_(model.layout),
        form_(input_form(model.layout.kind)),
        width_(model.width),
        height_(model.height),
        decode_(std::move(decode)),
        precision_(std::move(precision)) {}

  Result<Segmentation> segment(const RgbdFrame& frame) override {
    const std::string name = "frame " + std::to_string(index(frame.id));
    if (frame.colour.empty()) return Error{ErrorKind::kInput, name + ": no colour image"};
    const Letterbox box = make_letterbox(frame.colour.width(), frame.colour.height(), width_,
                                         height_, form_.placement);
    try {
      infer(frame.colour, box);
      const trace::Span span("decode masks");
      const std::vector<OutputTensor> tensors = outputs();
      auto decoded = decode_outputs(layout_, tensors, box, decode_);
      if (!decoded.ok()) return Error{ErrorKind::kModel, name + ": " + decoded.error().message};
      if (decoded->rejected > 0 && decoded->instances.empty()) {
        return Error{ErrorKind::kModel, name + ": the network's output makes no sense (" +
                                            std::to_string(decoded->rejected) + " bad values)"};
      }
      // Masks are coarser than the image: half a cell of theirs.
      const double edge_px = 0.5 * mask_cell_px(layout_, tensors, box) / box.scale_x();
      return Segmentation{frame.id, frame.stamp, std::move(decoded->instances),
                          std::move(decoded->ids), static_cast<int>(std::lround(edge_px))};
    } catch (const std::exception& e) {
      return Error{ErrorKind::kModel, name + ": the network failed: " + fault_in(e.what())};
    }
  }
  std::string precision() const override { return precision_; }

 private:
  void infer(const ColourImage& colour, const Letterbox& box) {
    const trace::Span span("inference");
    fill_input(colour, box);
    request_.infer();
  }
  void fill_input(const ColourImage& colour, const Letterbox& box) {
    auto* input = request_.get_input_tensor().data<float>();
    if (box.identity()) {
      to_planar(colour, form_.colours, input);
    } else {
      to_planar(letterboxed(colour, box), form_.colours, input);
    }
  }

  std::vector<OutputTensor> outputs() {
    std::vector<OutputTensor> tensors;
    for (std::size_t i = 0; i < request_.get_compiled_model().outputs().size(); ++i) {
      const ov::Tensor tensor = request_.get_output_tensor(i);
      tensors.push_back({{tensor.data<const float>(), tensor.get_size()}, tensor.get_shape()});
    }
    return tensors;
  }

  ov::InferRequest request_;
  OutputLayout layout_;
  InputForm form_;
  int width_, height_;
  DecodeConfig decode_;
  std::string precision_;
};

Status check(const ModelConfig& config) {
  const auto require = [](bool fine, const std::string& what) -> Status {
    if (fine) return Ok{};
    return Error{ErrorKind::kConfig, what};
  };
  const auto is_side = [](int size) { return size >= 32 && size <= 2048 && size % 32 == 0; };
  const auto is_share = [](double value) { return value >= 0.0 && value <= 1.0; };
  for (const Status& status :
       {require(config.threads >= 1, "the network needs at least 1 thread"),
        require(is_side(config.input_width) && is_side(config.input_height),
                "the network's input size must be multiples of 32 up to 2048"),
        require(is_share(config.decode.score_threshold), "score threshold must be in 0..1"),
        require(is_share(config.decode.nms_iou), "overlap limit (IoU) must be in 0..1"),
        require(config.decode.max_instances >= 1 && config.decode.max_instances <= kMaxInstances,
                "number of instances must be in 1..255")}) {
    if (!status.ok()) return status.error();
  }
  return Ok{};
}

/// RF-DETR's class logits do not survive half precision
/// (https://rfdetr.roboflow.com/latest/exports/openvino).
Precision wanted_precision(Precision configured, const ModelFile& model) {
  const bool needs_f32 = model.layout.kind == OutputKind::kRfdetr && !model.quantised;
  return configured == Precision::kAuto && needs_f32 ? Precision::kF32 : configured;
}

/// Nobody knows what a network of the user's own should answer, so the built-in one is asked.
Status check_processor(int threads) {
  if (!embedded_network("people.onnx")) return Ok{};
  const auto people =
      make_people_segmenter(CameraConfig{.fx = 525, .fy = 525}, {Precision::kAuto, threads});
  return people.ok() ? Status(Ok{}) : Status(people.error());
}

}  // namespace

Result<std::unique_ptr<Segmenter>> make_model_segmenter(const ModelConfig& config) {
  if (const Status sound = check(config); !sound.ok()) return sound.error();
  require_memory(kLeastMemory_bytes);
  const auto read = [&] {
    return read_model_file(config.model, config.input_width, config.input_height);
  };
  if (config.try_in_child) {
    const Status probed = try_in_child(
        [&]() -> Status {
          const auto model = read();
          if (!model.ok()) return model.error();
          return Ok{};
        },
        config.model.string());
    if (!probed.ok()) return probed.error();
  }

  auto model = read();
  if (!model.ok()) return model.error();
  const std::string name = config.model.string();
  const auto precision =
      choose_precision(wanted_precision(config.precision, *model), model->quantised, name);
  if (!precision.ok()) return precision.error();
  if (config.check_processor)
    if (const Status right = check_processor(config.threads); !right.ok()) return right.error();
  const auto weights = leave_weights_in(config.model, *model->network);
  auto request = compile_network(std::move(model->network), *precision, config.threads, name);
  if (!request.ok()) return request.error();
  if (weights) weights->give_back();
  return std::unique_ptr<Segmenter>(std::make_unique<ModelSegmenter>(
      std::move(request).value(), *model, config.decode, name_of(*precision)));
}

}  // namespace ygslam
