#include "app/mask_recorder.hpp"

#include <nlohmann/json.hpp>

#include "core/counted.hpp"
#include "core/log.hpp"
#include "io/atomic_file.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

constexpr std::size_t kMostIds = 255;
constexpr int kNameDecimals = 6;  // files are found to within a microsecond

}  // namespace

MaskRecorder::MaskRecorder(std::filesystem::path directory) : directory_(std::move(directory)) {}

std::uint8_t MaskRecorder::id_of(int class_id, int n) {
  if (const auto known = ids_.find({class_id, n}); known != ids_.end()) return known->second;
  if (ids_.size() == kMostIds) return 0;
  names_are_written_ = false;
  return ids_[{class_id, n}] = static_cast<std::uint8_t>(ids_.size() + 1);
}

Status MaskRecorder::write(const Segmentation& masks) {
  std::map<int, int> count_of_class;
  std::vector<std::uint8_t> id_of_value{0};
  for (const Instance& instance : masks.instances) {
    id_of_value.push_back(id_of(instance.class_id, count_of_class[instance.class_id]++));
    left_out_ += id_of_value.back() == 0 ? 1 : 0;
  }
  GreyImage ids = masks.ids;
  for (std::uint8_t& id : ids) id = id_of_value[id];
  const std::string name = format_stamp(masks.stamp, kNameDecimals) + ".png";
  return write_file_atomically(directory_ / name, encode_png(ids, 1, PngFilter::kUp));
}

Status MaskRecorder::add(const FramePtr& /*frame*/, const TrackResult& result) {
  for (const SegmentationPtr& masks : result.masks)
    if (Status written = write(*masks); !written.ok()) return written;
  return names_are_written_ ? Ok{} : finish();
}

Status MaskRecorder::finish() {
  nlohmann::json names = nlohmann::json::object();
  for (const auto& [instance, id] : ids_)
    names[std::to_string(id)] = coco_class_names()[static_cast<std::size_t>(instance.first)];
  if (left_out_ > 0) {
    log::warn("{}: {} left out: a folder of masks names at most {}", directory_.string(),
              counted(left_out_, "instance"), kMostIds);
    left_out_ = 0;
  }
  names_are_written_ = true;
  return write_file_atomically(directory_ / "instances.json", names.dump(2) + "\n");
}

}  // namespace ygslam
