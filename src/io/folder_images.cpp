#include "io/folder_images.hpp"

#include <utility>

#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

class FolderImages final : public ImageSource {
 public:
  explicit FolderImages(fs::path root) : root_(std::move(root)) {}

  Result<ImageHeader> header(const std::string& name) const override {
    const auto bytes = read(name);
    return bytes.ok() ? decode_header(*bytes) : Result<ImageHeader>(bytes.error());
  }
  Result<ColourImage> colour(const std::string& name, const ImageSize& size,
                             int channels) const override {
    const auto bytes = read(name);
    if (!bytes.ok()) return bytes.error();
    return decode_colour(*bytes, size, channels);
  }
  Result<DepthImage> depth_m(const std::string& name, const CameraConfig& camera,
                             const DepthConfig& config) const override {
    const auto bytes = read(name);
    if (!bytes.ok()) return bytes.error();
    return decode_depth_m(*bytes, ImageSize{camera.width, camera.height}, camera.depth_scale,
                          config);
  }

 private:
  Result<std::string> read(const std::string& name) const {
    const fs::path path = root_ / name;
    auto bytes = read_file(path);
    if (bytes.ok()) return bytes;
    // "PATH: reason" without the path
    return Error{ErrorKind::kInput, bytes.error().message.substr(path.string().size() + 2)};
  }

  fs::path root_;
};

}  // namespace

std::shared_ptr<const ImageSource> images_of_folder(const fs::path& root) {
  return std::make_shared<FolderImages>(root);
}

}  // namespace ygslam
