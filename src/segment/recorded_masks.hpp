// Masks from files in place of a network's: rendered truth, or what another program computed.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>

#include "segment/segmenter.hpp"

namespace ygslam {

/// COCO class of each instance id, -1 for one that COCO does not know; 0 (person) by default.
using ClassOfId = std::array<int, 256>;
/// Of a folder of masks, from instances.json there or, as in rendered sequences, in the folder
/// above: an object that maps id to a class name or number. @return kInput.
[[nodiscard]] Result<ClassOfId> read_recorded_classes(const std::filesystem::path& directory);
/// The text of an instances.json. @param name for messages. @return kInput.
[[nodiscard]] Result<ClassOfId> parse_instances(const std::string& text, const std::string& name);

/// Reads `directory`/STAMP.png, 8-bit instance ids (0 = none), where STAMP is the colour image's
/// stamp in seconds (to within 1 us). Classes COCO does not know are left out, as a network trained
/// on it would.
///
/// The segmenter's error for one frame: no mask, an unreadable one, or one of another size than the
/// colour image. Its own: `directory` without any mask, or a bad instances.json (kInput).
[[nodiscard]] Result<std::unique_ptr<Segmenter>> make_recorded_segmenter(
    const std::filesystem::path& directory);

}  // namespace ygslam
