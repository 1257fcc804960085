#include "segment/people_network.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <openvino/runtime/core.hpp>

#include "core/memory.hpp"
#include "core/trace.hpp"
#include "segment/embedded_network.hpp"
#include "segment/known_person.hpp"
#include "segment/openvino_network.hpp"
#include "segment/people_decode.hpp"
#include "segment/people_input.hpp"

namespace ygslam {
namespace {

constexpr const char* kName = "the built-in people network";

class PeopleSegmenter final : public Segmenter {
 public:
  PeopleSegmenter(ov::InferRequest request, const CameraConfig& camera, std::string precision)
      : request_(std::move(request)),
        width_(camera.width),
        height_(camera.height),
        input_(camera),
        precision_(std::move(precision)) {}

  Result<Segmentation> segment(const RgbdFrame& frame) override {
    const std::string name = "frame " + std::to_string(index(frame.id));
    if (frame.colour.width() != width_ || frame.colour.height() != height_ ||
        !frame.depth_m.same_size(frame.colour))
      return Error{ErrorKind::kInput, name + ": images not of the camera's size"};
    try {
      infer(frame.depth_m);
      const std::span logits(request_.get_output_tensor().data<const float>(),
                             std::size_t{kPeopleCells});
      if (!std::all_of(logits.begin(), logits.end(), [](float x) { return std::isfinite(x); }))
        return Error{ErrorKind::kModel, name + ": the network's output makes no sense"};
      const trace::Span span("decode masks");
      DecodedPeople people = decode_people(logits, input_.depth_m(), input_.grid(),
                                           input_.focal_cells(), width_, height_);
      return Segmentation{frame.id, frame.stamp, std::move(people.instances),
                          std::move(people.ids)};
    } catch (const std::exception& e) {
      return Error{ErrorKind::kModel, name + ": the network failed: " + fault_in(e.what())};
    }
  }
  std::string precision() const override { return precision_; }
  bool in_step() const override { return true; }

 private:
  void infer(const DepthImage& depth_m) {
    const trace::Span span("inference");
    input_.fill(depth_m, request_.get_input_tensor().data<float>());
    request_.infer();
  }

  ov::InferRequest request_;
  int width_, height_;
  PeopleInput input_;
  std::string precision_;
};

Error fault(const std::string& what) {
  return {ErrorKind::kModel, std::string(kName) + ": " + what};
}

Result<std::shared_ptr<ov::Model>> read(std::string_view bytes, std::string_view ir_weights) {
  try {
    ov::Tensor weights;
    if (!ir_weights.empty()) {
      weights = ov::Tensor(ov::element::u8, {ir_weights.size()});
      std::memcpy(weights.data(), ir_weights.data(), ir_weights.size());
    }
    std::shared_ptr<ov::Model> network = ov::Core().read_model(std::string(bytes), weights);
    const ov::PartialShape cells{1, kPeopleChannels, kPeopleRows, kPeopleColumns};
    const ov::PartialShape people{1, 1, kPeopleRows, kPeopleColumns};
    if (network->inputs().size() != 1 || network->outputs().size() != 1 ||
        network->input().get_partial_shape() != cells ||
        network->output().get_partial_shape() != people ||
        network->input().get_element_type() != ov::element::f32 ||
        network->output().get_element_type() != ov::element::f32)
      return fault("is not of the shape that training/export.py writes");
    return network;
  } catch (const std::exception& e) {
    require_memory(kAmpleMemory_bytes);
    return fault("cannot be read: " + fault_in(e.what()));
  }
}

struct CompiledNetwork {
  ov::InferRequest request;
  Precision precision;
};

Result<CompiledNetwork> compile(std::string_view network, std::string_view ir_weights,
                                const PeopleConfig& config) {
  auto model = read(network, ir_weights);
  if (!model.ok()) return model.error();
  const auto precision = choose_precision(config.precision, is_quantised(**model), kName);
  if (!precision.ok()) return precision.error();
  auto request = compile_network(std::move(*model), *precision, config.threads, kName);
  if (!request.ok()) return request.error();
  return CompiledNetwork{std::move(request).value(), *precision};
}

std::unique_ptr<PeopleSegmenter> segmenter_of(const CompiledNetwork& compiled,
                                              const CameraConfig& camera) {
  return std::make_unique<PeopleSegmenter>(compiled.request, camera, name_of(compiled.precision));
}

}  // namespace

Result<std::unique_ptr<Segmenter>> make_people_segmenter(const CameraConfig& camera,
                                                         const PeopleConfig& config) {
  const bool int8 = config.precision == Precision::kInt8;
  const std::string name = int8 ? "people_int8.xml" : "people.onnx";
  const auto network = embedded_network(name);
  const auto weights = int8 ? embedded_network("people_int8.bin") : std::string_view();
  if (!network || !weights)
    return fault("not in this build (assets/" + name +
                 " was missing), use --segmenter model with --model FILE");
  const auto compiled = compile(*network, *weights, config);
  if (!compiled.ok()) return compiled.error();
  const KnownPerson known = draw_known_person();
  const Status finds = check_finds(known, *segmenter_of(*compiled, known.camera));
  if (!finds.ok()) return fault(finds.error().message);
  return std::unique_ptr<Segmenter>(segmenter_of(*compiled, camera));
}

Result<std::unique_ptr<Segmenter>> make_people_segmenter(std::string_view network,
                                                         const CameraConfig& camera,
                                                         const PeopleConfig& config,
                                                         std::string_view ir_weights) {
  const auto compiled = compile(network, ir_weights, config);
  if (!compiled.ok()) return compiled.error();
  return std::unique_ptr<Segmenter>(segmenter_of(*compiled, camera));
}

}  // namespace ygslam
