#include "facade/input.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "facade/convert.hpp"
#include "facade/settings.hpp"
#include "io/image_file.hpp"

namespace ygslam::api {
namespace {

[[noreturn]] void refuse(const std::string& what) { fail({ErrorKind::kInput, what}); }

/// Rows of a caller's image.
struct RowReader {
  const std::uint8_t* first;
  std::size_t stride;  // bytes

  /// @param name for the message. @param stride 0 = as long as a row.
  RowReader(const void* data, std::size_t row_bytes, std::size_t wanted_stride, const char* name)
      : first(static_cast<const std::uint8_t*>(data)),
        stride(wanted_stride == 0 ? row_bytes : wanted_stride) {
    if (stride < row_bytes)
      refuse(std::string(name) + ": " + std::to_string(stride) +
             " bytes from row to row, but a row has " + std::to_string(row_bytes));
  }
  [[nodiscard]] const std::uint8_t* row(int v) const {
    return first + static_cast<std::size_t>(v) * stride;
  }
};

template <typename T>
Image<T> copied(const T* data, const CameraConfig& size, std::size_t stride, const char* name) {
  const std::size_t bytes = static_cast<std::size_t>(size.width) * sizeof(T);
  const RowReader rows(data, bytes, stride, name);
  Image<T> image(size.width, size.height);
  for (int v = 0; v < size.height; ++v) std::memcpy(image.row(v), rows.row(v), bytes);
  return image;
}

ColourImage colour_of(const Frame& frame, const CameraConfig& size) {
  const int channels = frame.colour == ColourOrder::kMono ? 1 : 3;
  const RowReader rows(frame.rgb, static_cast<std::size_t>(size.width) * channels,
                       frame.colour_stride, "colour");
  ColourImage image(size.width, size.height);
  for (int v = 0; v < size.height; ++v) {
    const std::uint8_t* from = rows.row(v);
    Rgb8* to = image.row(v);
    for (int u = 0; u < size.width; ++u, from += channels) {
      if (frame.colour == ColourOrder::kRgb) to[u] = {from[0], from[1], from[2]};
      if (frame.colour == ColourOrder::kBgr) to[u] = {from[2], from[1], from[0]};
      if (frame.colour == ColourOrder::kMono) to[u] = {from[0], from[0], from[0]};
    }
  }
  return image;
}

DepthImage depth_of(const Frame& frame, const InputFormat& format) {
  if (frame.depth_m && frame.depth_raw) refuse("frame with depth in metres and raw depth");
  const CameraConfig& size =
      format.registration ? format.registration->depth_camera() : format.camera;
  DepthImage depth_m;
  if (frame.depth_m) {
    depth_m = copied(frame.depth_m, size, frame.depth_stride, "depth");
  } else {
    if (!(frame.depth_scale > 0 && std::isfinite(frame.depth_scale)))
      refuse("depth_scale: units per metre, above 0, are expected with raw depth");
    const auto raw = copied(frame.depth_raw, size, frame.depth_stride, "depth");
    depth_m = DepthImage(raw.width(), raw.height());
    const double metre = 1 / frame.depth_scale;
    std::ranges::transform(raw, depth_m.begin(), [metre](std::uint16_t units) {
      return static_cast<float>(units * metre);
    });
  }
  depth_m = sanitized_depth(depth_m, format.depth);
  return format.registration ? format.registration->registered(depth_m) : depth_m;
}

ygslam::Instance to_instance(const Instance& from) {
  const auto& names = coco_class_names();
  const auto found = std::ranges::find(names, from.class_name);
  if (found == names.end()) refuse("instances: " + from.class_name + " is no COCO class");
  if (!(from.score >= 0 && from.score <= 1)) refuse("instances: a score of 0 to 1 is expected");
  ygslam::Instance instance;
  instance.class_id = static_cast<int>(found - names.begin());
  instance.score = from.score;
  return instance;
}

/// The smallest boxes about the masks.
void find_boxes(Segmentation& masks) {
  std::vector<bool> seen(masks.instances.size());
  for (int v = 0; v < masks.ids.height(); ++v) {
    for (int u = 0; u < masks.ids.width(); ++u) {
      const std::uint8_t id = masks.ids.at(u, v);
      if (id == 0) continue;
      if (id > masks.instances.size())
        refuse("instances: a pixel has id " + std::to_string(id) + ", of " +
               std::to_string(masks.instances.size()));
      ygslam::Instance& box = masks.instances[id - 1U];
      const auto x = static_cast<float>(u), y = static_cast<float>(v);
      const bool is_first = !seen[id - 1U];
      seen[id - 1U] = true;
      box.x0 = is_first ? x : std::min(box.x0, x);
      box.y0 = is_first ? y : std::min(box.y0, y);
      box.x1 = is_first ? x + 1 : std::max(box.x1, x + 1);
      box.y1 = is_first ? y + 1 : std::max(box.y1, y + 1);
    }
  }
}

std::shared_ptr<Segmentation> masks_of(const Frame& frame, const InputFormat& format) {
  if (!frame.instance_ids && frame.instances.empty()) return nullptr;
  if (!format.takes_instances) refuse("frame with instances: segmenter \"frames\" takes them");
  if (!frame.instance_ids) refuse("instances without the image of their ids");
  constexpr std::size_t kMost = 255;
  if (frame.instances.size() > kMost) refuse("instances: at most 255 are taken");
  auto masks = std::make_shared<Segmentation>();
  for (const Instance& instance : frame.instances)
    masks->instances.push_back(to_instance(instance));
  masks->ids = copied(frame.instance_ids, format.camera, frame.instance_stride, "instances");
  find_boxes(*masks);
  return masks;
}

}  // namespace

Input read_input(const Frame& frame, const InputFormat& format) {
  if (!frame.rgb || (!frame.depth_m && !frame.depth_raw)) refuse("frame without colour or depth");
  Input input{std::make_shared<RgbdFrame>()};
  if (frame.T_last_camera)
    input.T_now_last = to_se3(*frame.T_last_camera, "T_last_camera").inverse();
  input.masks = masks_of(frame, format);
  RgbdFrame& content = *input.frame;
  content.stamp = {frame.t_ns};
  if (frame.depth_t_ns != 0)
    content.depth_delay_s = seconds_between({frame.depth_t_ns}, {frame.t_ns});
  content.colour = colour_of(frame, format.camera);
  content.grey = grey_from_colour(content.colour);
  content.depth_m = depth_of(frame, format);
  return input;
}

}  // namespace ygslam::api
