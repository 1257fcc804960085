// The project's own network, which finds people in depth, behind the Segmenter interface
// (docs/model-card.md).
#pragma once

#include <memory>
#include <string_view>

#include "geometry/camera.hpp"
#include "segment/precision.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {

struct PeopleConfig {
  Precision precision = Precision::kAuto;
  int threads = 1;  ///< that run the network
};

/// With the weights built into the library, for kInt8 those of the quantised network. The segmenter
/// is in step with the frames, and has found a drawn person (known_person.hpp). @return kModel:
/// built without weights, or it has not; kConfig: a precision that network or processor does not
/// have. Throws std::bad_alloc.
[[nodiscard]] Result<std::unique_ptr<Segmenter>> make_people_segmenter(const CameraConfig& camera,
                                                                       const PeopleConfig& config);
/// With a file's bytes: ONNX as training/export.py writes it, or OpenVINO IR and its weights as
/// training/quantize.py does. Nobody is drawn for it: it may have been trained for others.
/// @return also kModel: bytes that are no such network.
[[nodiscard]] Result<std::unique_ptr<Segmenter>> make_people_segmenter(
    std::string_view network, const CameraConfig& camera, const PeopleConfig& config,
    std::string_view ir_weights = {});

}  // namespace ygslam
