// A segmentation network out of a file (docs/models.md) on the CPU through OpenVINO, behind the
// Segmenter interface.
#pragma once

#include <filesystem>
#include <memory>

#include "segment/detections.hpp"
#include "segment/precision.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {

struct ModelConfig {
  std::filesystem::path model;  ///< .onnx, or OpenVINO's .xml with its .bin beside it
  Precision precision = Precision::kAuto;
  int threads = 1;         ///< that run the network
  int input_width = 640;   ///< [px] multiple of 32; for models exported with open sizes
  int input_height = 480;  ///< [px] multiple of 32
  DecodeConfig decode;
  /// The file is first read in a child process, so that one made to crash the reader costs an error
  /// and no more (see model_probe.hpp about threads).
  bool try_in_child = false;
  /// First the built-in people network has to find a drawn person, where it is in the build.
  bool check_processor = !kIsTriedProcessor;
};

/// Loads the network.
/// @return kModel: file missing, unreadable or of no kind that is read, or OpenVINO errs on this
/// processor; kConfig: a precision that
/// model or processor does not have, or a bad number in the configuration. Throws std::bad_alloc.
[[nodiscard]] Result<std::unique_ptr<Segmenter>> make_model_segmenter(const ModelConfig& config);

}  // namespace ygslam
