#include "segment/yolo_openvino.hpp"

#include <algorithm>
#include <cmath>
#include <openvino/runtime/core.hpp>

#include "core/memory.hpp"
#include "core/trace.hpp"
#include "segment/model_probe.hpp"
#include "segment/openvino_network.hpp"
#include "segment/planar.hpp"
#include "segment/yolo_model.hpp"

namespace ygslam {
namespace {

// With less OpenVINO may crash. The nano network takes some 150 MB.
constexpr std::size_t kLeastMemory_bytes = std::size_t{128} << 20;

class YoloSegmenter final : public Segmenter {
 public:
  YoloSegmenter(ov::InferRequest request, YoloLayout layout, DecodeConfig decode,
                std::string precision)
      : request_(std::move(request)),
        layout_(layout),
        decode_(std::move(decode)),
        precision_(std::move(precision)) {}

  Result<Segmentation> segment(const RgbdFrame& frame) override {
    const std::string name = "frame " + std::to_string(index(frame.id));
    if (frame.colour.empty()) return Error{ErrorKind::kInput, name + ": no colour image"};
    const Letterbox box =
        make_letterbox(frame.colour.width(), frame.colour.height(), layout_.width, layout_.height);
    try {
      infer(frame.colour, box);
      const trace::Span span("decode masks");
      DecodedYolo decoded = decode_yolo(outputs(), box, decode_);
      if (decoded.rejected > 0 && decoded.instances.empty()) {
        return Error{ErrorKind::kModel, name + ": the network's output makes no sense (" +
                                            std::to_string(decoded.rejected) + " bad values)"};
      }
      return Segmentation{frame.id, frame.stamp, std::move(decoded.instances),
                          std::move(decoded.ids), edge_px(box)};
    } catch (const std::exception& e) {
      return Error{ErrorKind::kModel, name + ": the network failed: " + fault_in(e.what())};
    }
  }
  std::string precision() const override { return precision_; }

 private:
  /// Half a cell of the network's masks, which are coarser than the image.
  [[nodiscard]] int edge_px(const Letterbox& box) const {
    return static_cast<int>(
        std::lround(0.5 * layout_.width / (layout_.proto_width * box.scale_x())));
  }
  void infer(const ColourImage& colour, const Letterbox& box) {
    const trace::Span span("inference");
    fill_input(colour, box);
    request_.infer();
  }
  void fill_input(const ColourImage& colour, const Letterbox& box) {
    auto* input = request_.get_input_tensor().data<float>();
    if (box.identity()) {
      to_planar(colour, input);
    } else {
      to_planar(letterboxed(colour, box), input);
    }
  }

  YoloOutputs outputs() {
    const ov::Tensor boxes = request_.get_output_tensor(layout_.boxes_first ? 0 : 1);
    const ov::Tensor prototypes = request_.get_output_tensor(layout_.boxes_first ? 1 : 0);
    return {{boxes.data<const float>(), boxes.get_size()},
            layout_.cells,
            {prototypes.data<const float>(), prototypes.get_size()},
            layout_.proto_width,
            layout_.proto_height};
  }

  ov::InferRequest request_;
  YoloLayout layout_;
  DecodeConfig decode_;
  std::string precision_;
};

Status check(const YoloConfig& config) {
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

}  // namespace

Result<std::unique_ptr<Segmenter>> make_yolo_segmenter(const YoloConfig& config) {
  if (const Status sound = check(config); !sound.ok()) return sound.error();
  require_memory(kLeastMemory_bytes);
  const auto read = [&] {
    return read_yolo_model(config.model, config.input_width, config.input_height);
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

  const auto model = read();
  if (!model.ok()) return model.error();
  const std::string name = config.model.string();
  const auto precision = choose_precision(config.precision, model->layout.quantised, name);
  if (!precision.ok()) return precision.error();
  auto request = compile_network(model->network, *precision, config.threads, name);
  if (!request.ok()) return request.error();
  return std::unique_ptr<Segmenter>(std::make_unique<YoloSegmenter>(
      std::move(request).value(), model->layout, config.decode, name_of(*precision)));
}

}  // namespace ygslam
