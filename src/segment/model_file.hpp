// A network file, read and found to be of a kind that can be decoded. Internal to this folder.
#pragma once

#include <filesystem>
#include <memory>

#include "core/result.hpp"
#include "segment/output_kind.hpp"

namespace ov {
class Model;
}

namespace ygslam {

struct ModelFile {
  std::shared_ptr<ov::Model> network;  ///< static input shape, f32 input and outputs
  OutputLayout layout;
  int width = 0, height = 0;  ///< of the input [px]
  bool quantised = false;     ///< has FakeQuantize operations: made for int8
};

/// Reads an ONNX or OpenVINO IR file. @param width, height used where the file leaves them open.
/// @return kModel with file and fault if it is no network or of no kind that is read.
[[nodiscard]] Result<ModelFile> read_model_file(const std::filesystem::path& file, int width,
                                                int height);

}  // namespace ygslam
