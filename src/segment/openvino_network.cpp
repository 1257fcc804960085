#include "segment/openvino_network.hpp"

#include <algorithm>
#include <cctype>
#include <openvino/op/fake_quantize.hpp>
#include <openvino/runtime/core.hpp>
#include <openvino/runtime/properties.hpp>
#include <sstream>

#include "core/memory.hpp"
#include "core/printable.hpp"
#include "segment/cpu_features.hpp"

namespace ygslam {

std::string fault_in(const std::string& report) {
  std::istringstream lines(report);
  std::string line;
  std::string chosen;
  while (std::getline(lines, line)) {
    const bool blank =
        std::all_of(line.begin(), line.end(), [](unsigned char c) { return std::isspace(c) != 0; });
    const bool position = line.find("Exception from ") == 0;
    if (!blank && (!position || chosen.empty())) chosen = line;
  }
  constexpr std::size_t kLongest = 200;
  return one_line(chosen.substr(0, kLongest));
}

bool is_quantised(const ov::Model& network) {
  const auto ops = network.get_ops();
  return std::any_of(ops.begin(), ops.end(),
                     [](const auto& op) { return ov::is_type<ov::op::v0::FakeQuantize>(op); });
}

Result<Precision> choose_precision(Precision wanted, bool is_quantised, const std::string& name) {
  const auto no = [&](const std::string& why) {
    return Error{ErrorKind::kConfig, name + ": " + why};
  };
  switch (wanted) {
    case Precision::kAuto:
      if (is_quantised) return Precision::kInt8;
      return cpu_bf16() == Bf16::kFast ? Precision::kBf16 : Precision::kF32;
    case Precision::kInt8:
      if (is_quantised) return Precision::kInt8;
      return no("precision int8 needs a quantised model (make quantize)");
    case Precision::kBf16:
      if (is_quantised) return no("is quantised, precision bf16 needs the model it was made from");
      if (cpu_bf16() != Bf16::kNone) return Precision::kBf16;
      return no("precision bf16: this processor has neither AVX512_BF16 nor AMX");
    case Precision::kF32:
      break;
  }
  if (is_quantised) return no("is quantised, precision f32 needs the model it was made from");
  return Precision::kF32;
}

std::string name_of(Precision precision) {
  switch (precision) {
    case Precision::kInt8:
      return "int8";
    case Precision::kBf16:
      return "bf16";
    default:
      return "f32";
  }
}

Result<ov::InferRequest> compile_network(std::shared_ptr<ov::Model> network, Precision precision,
                                         int threads, const std::string& name) {
  // A quantised model's remaining float operations run as f32.
  const auto type = precision == Precision::kBf16 ? ov::element::bf16 : ov::element::f32;
  try {
    ov::CompiledModel compiled = ov::Core().compile_model(
        network, "CPU", ov::hint::performance_mode(ov::hint::PerformanceMode::LATENCY),
        ov::hint::inference_precision(type), ov::hint::enable_cpu_pinning(false),
        ov::inference_num_threads(threads), ov::num_streams(1));
    ov::InferRequest request = compiled.create_infer_request();
    network.reset();
    // Compiling takes ten times the code that running does.
    give_back_startup_memory("libopenvino");
    return request;
  } catch (const std::exception& e) {
    require_memory(kAmpleMemory_bytes);
    return Error{ErrorKind::kModel, name + ": cannot be compiled: " + fault_in(e.what())};
  }
}

}  // namespace ygslam
