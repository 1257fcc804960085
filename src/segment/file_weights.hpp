// The weights of a network left in its file. Internal to this folder.
#pragma once

#include <filesystem>
#include <memory>

#include "core/file_view.hpp"

namespace ov {
class Model;
}

namespace ygslam {

/// OpenVINO keeps the weights of a compiled network as they were read, beside those that it runs
/// with, and looks at the former no more. Large ones whose bytes stand in the file as they are
/// become views of it, so that what memory holds of them can be given back.
/// @return what to give back once the network is compiled; null: nothing was found in the file.
[[nodiscard]] std::shared_ptr<const FileView> leave_weights_in(
    const std::filesystem::path& onnx_file, ov::Model& network);

}  // namespace ygslam
