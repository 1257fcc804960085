// segment_bench MODEL... [--sequence DIR] [--frames N] [--score S] [--iou I]
//
// For every precision each model has on this processor: wall time of the bare network (OpenVINO's
// API, one thread, latency hint, otherwise its defaults, as benchmark_app runs it) and of our whole
// segmenter (preparation, network, decoding, masks at image size), measured in turns so that both
// see the same machine. MODEL: a network of docs/models.md or builtin. Also the share of the images
// under person masks, and with a sequence that has mask/ how well they agree with it.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <openvino/runtime/core.hpp>
#include <openvino/runtime/properties.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/statistics.hpp"
#include "core/time.hpp"
#include "io/frame_reader.hpp"
#include "io/image_folders.hpp"
#include "segment/embedded_network.hpp"
#include "segment/model_segmenter.hpp"
#include "segment/people_network.hpp"
#include "segment/png_ids.hpp"

namespace ygslam::bench {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBuiltin = "builtin";

struct Options {
  std::vector<std::string> models;
  fs::path sequence;
  int frames = 60;
  DecodeConfig decode;
};

struct Sample {
  FramePtr frame;
  std::optional<GreyImage> truth;
};

struct Samples {
  CameraConfig camera;
  std::vector<Sample> frames;
};

Samples plain(const Options& options) {
  Samples samples;
  samples.camera.fx = samples.camera.fy = 525;
  samples.camera.cx = 319.5, samples.camera.cy = 239.5;
  const auto frame = std::make_shared<const RgbdFrame>(RgbdFrame{
      FrameId{0}, {}, ColourImage(640, 480, {90, 120, 60}), {}, DepthImage(640, 480, 2.0F)});
  samples.frames.assign(static_cast<std::size_t>(options.frames), {frame, {}});
  return samples;
}

Samples load(const Options& options) {
  if (options.sequence.empty()) return plain(options);
  auto sequence = open_folder_sequence(options.sequence);
  if (!sequence.ok()) {
    std::fprintf(stderr, "%s\n", sequence.error().message.c_str());
    std::exit(4);
  }
  Samples samples{sequence->camera, {}};
  const auto pairs = sequence->pairs;
  FrameReaderConfig reading;
  reading.stride = std::max<std::size_t>(1, pairs.size() / options.frames);
  FrameReader reader(std::move(*sequence), reading);
  while (auto frame = reader.next()) {
    const fs::path colour = pairs[index((*frame)->id) * reading.stride].colour_file;
    const fs::path mask = options.sequence / "mask" / colour.filename().replace_extension("png");
    Sample sample{std::move(*frame), {}};
    if (fs::exists(mask))
      if (auto ids = read_png_ids(mask); ids.ok()) sample.truth = std::move(*ids);
    samples.frames.push_back(std::move(sample));
  }
  return samples;
}

/// Intersection over union of the set pixels; nullopt where the truth has none.
std::optional<double> mask_iou(const GreyImage& ids, const GreyImage& truth) {
  int both = 0;
  int either = 0;
  bool any = false;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const bool ours = ids.data()[i] > 0;
    const bool wanted = truth.data()[i] > 0;
    both += ours && wanted ? 1 : 0;
    either += ours || wanted ? 1 : 0;
    any = any || wanted;
  }
  if (!any) return std::nullopt;
  return static_cast<double>(both) / either;
}

double masked_share(const GreyImage& ids) {
  const auto none = std::count(ids.begin(), ids.end(), std::uint8_t{0});
  return 1.0 - static_cast<double>(none) / static_cast<double>(ids.size());
}

class BareNetwork {
 public:
  BareNetwork(const std::string& model, const std::string& precision) {
    const auto type = precision == "bf16" ? ov::element::bf16 : ov::element::f32;
    const auto network = model == kBuiltin ? read_builtin(precision) : core_.read_model(model);
    compiled_ = core_.compile_model(
        network, "CPU", ov::hint::performance_mode(ov::hint::PerformanceMode::LATENCY),
        ov::inference_num_threads(1), ov::hint::inference_precision(type));
    request_ = compiled_.create_infer_request();
  }
  double infer_ms() {
    const ScopedTimer timer;
    request_.infer();
    return timer.wall_ms();
  }

 private:
  std::shared_ptr<ov::Model> read_builtin(const std::string& precision) {
    if (precision != "int8")
      return core_.read_model(std::string(*embedded_network("people.onnx")), ov::Tensor());
    const std::string_view bytes = *embedded_network("people_int8.bin");
    ov::Tensor weights(ov::element::u8, {bytes.size()});
    std::copy(bytes.begin(), bytes.end(), static_cast<char*>(weights.data()));
    return core_.read_model(std::string(*embedded_network("people_int8.xml")), weights);
  }

  ov::Core core_;
  ov::CompiledModel compiled_;
  ov::InferRequest request_;
};

Result<std::unique_ptr<Segmenter>> make(const Options& options, const std::string& model,
                                        Precision precision, const CameraConfig& camera) {
  if (model == kBuiltin) return make_people_segmenter(camera, {precision, 1});
  ModelConfig config;
  config.model = model;
  config.precision = precision;
  config.decode = options.decode;
  return make_model_segmenter(config);
}

void measure(const Options& options, const std::string& model, Precision precision,
             const Samples& samples) {
  const ScopedTimer start;
  const auto made = make(options, model, precision, samples.camera);
  const double load_ms = start.wall_ms();
  if (!made.ok()) {
    if (made.error().kind != ErrorKind::kConfig)
      std::fprintf(stderr, "%s\n", made.error().message.c_str());
    return;
  }
  Segmenter& segmenter = *made.value();
  BareNetwork bare(model, segmenter.precision());
  std::vector<double> bare_ms, wall_ms, cpu_ms;
  double iou_sum = 0;
  double masked = 0;
  int iou_count = 0;
  for (const Sample& sample : samples.frames) {
    bare_ms.push_back(bare.infer_ms());
    const ScopedTimer timer;
    const auto out = segmenter.segment(*sample.frame);
    wall_ms.push_back(timer.wall_ms());
    cpu_ms.push_back(timer.cpu_ms());
    if (out.ok()) masked += masked_share(out->ids) / static_cast<double>(samples.frames.size());
    if (!out.ok() || !sample.truth || !sample.truth->same_size(out->ids)) continue;
    if (const auto iou = mask_iou(out->ids, *sample.truth)) {
      iou_sum += *iou;
      ++iou_count;
    }
  }
  std::printf("%-34s %-5s %8.1f %8.1f %8.1f %7.2f %8.0f", fs::path(model).filename().c_str(),
              segmenter.precision().c_str(), median(bare_ms), median(wall_ms), median(cpu_ms),
              median(wall_ms) / median(bare_ms), load_ms);
  std::printf(" %7.2f", 100.0 * masked);
  if (iou_count > 0) std::printf("   %.4f (%d frames)", iou_sum / iou_count, iou_count);
  std::printf("\n");
}

std::optional<Options> parse(int argc, char** argv) {
  Options options;
  options.decode.classes = {0};
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    if (arg.rfind("--", 0) != 0) {
      options.models.push_back(arg);
      continue;
    }
    if (i + 1 >= argc) return std::nullopt;
    const char* value = argv[++i];
    if (arg == "--sequence") {
      options.sequence = value;
    } else if (arg == "--frames") {
      options.frames = std::max(1, std::atoi(value));
    } else if (arg == "--score") {
      options.decode.score_threshold = std::atof(value);
    } else if (arg == "--iou") {
      options.decode.nms_iou = std::atof(value);
    } else {
      return std::nullopt;
    }
  }
  if (options.models.empty()) return std::nullopt;
  return options;
}

}  // namespace
}  // namespace ygslam::bench

int main(int argc, char** argv) {
  using namespace ygslam;
  const auto options = bench::parse(argc, argv);
  if (!options) {
    std::fprintf(stderr,
                 "usage: segment_bench MODEL... [--sequence DIR] [--frames N] [--score S] "
                 "[--iou I]\n");
    return 2;
  }
  const auto samples = bench::load(*options);
  std::printf("%-34s %-5s %8s %8s %8s %7s %8s %7s   %s\n", "model", "as", "bare ms", "ours ms",
              "cpu ms", "ratio", "load ms", "mask %", "person IoU");
  for (const std::string& model : options->models) {
    for (const Precision p : {Precision::kF32, Precision::kBf16, Precision::kInt8}) {
      bench::measure(*options, model, p, samples);
    }
  }
  return 0;
}
