#include "io/exr_codec.hpp"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>

#include "io/text.hpp"

namespace ygslam::exr {
namespace {

Error exr_fault(std::string reason) { return {ErrorKind::kInput, std::move(reason)}; }

/// Bytes in memory as OpenEXR's stream.
class Source final : public Imf::IStream {
 public:
  explicit Source(std::string_view bytes) : IStream("EXR"), bytes_(bytes) {}
  bool read(char out[], int count) override {
    if (count < 0 || static_cast<std::uint64_t>(count) > bytes_.size() - at_)
      throw std::runtime_error("the file ends early");
    std::memcpy(out, bytes_.data() + at_, static_cast<std::size_t>(count));
    at_ += static_cast<std::uint64_t>(count);
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t at) override {
    if (at > bytes_.size()) throw std::runtime_error("the file ends early");
    at_ = at;
  }

 private:
  std::string_view bytes_;
  std::uint64_t at_ = 0;
};

/// The channel that is depth. @return empty if that is not plain.
std::string depth_channel(const Imf::ChannelList& channels) {
  std::string only;
  std::string named;
  int count = 0;
  for (auto at = channels.begin(); at != channels.end(); ++at, ++count) {
    only = at.name();
    std::string name = only.substr(only.rfind('.') == std::string::npos ? 0 : only.rfind('.') + 1);
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (name == "z" || name == "y" || name == "depth") named = named.empty() ? only : "?";
  }
  return count == 1 ? only : named == "?" ? "" : named;
}

std::string names_of(const Imf::ChannelList& channels) {
  constexpr std::size_t kLongest = 80;
  std::string names;
  for (auto at = channels.begin(); at != channels.end() && names.size() < kLongest; ++at)
    names += (names.empty() ? "" : ", ") + printable(at.name(), kLongest);
  return names;
}

struct Opened {
  ImageHeader header;
  std::string channel;
};

Result<Opened> opened(const Imf::InputFile& file) {
  const Imf::ChannelList& channels = file.header().channels();
  Opened found;
  found.channel = depth_channel(channels);
  if (found.channel.empty())
    return exr_fault("which of the channels of this EXR file is depth? " + names_of(channels) +
                     "; read are files of one channel, or with one called Z, Y or depth");
  const Imf::Channel& channel = channels[found.channel];
  if (channel.type == Imf::UINT || channel.xSampling != 1 || channel.ySampling != 1)
    return exr_fault("channel " + printable(found.channel) + " of this EXR file is no plain float");
  const auto& window = file.header().dataWindow();
  const auto side = [](int low, int high) {
    const std::int64_t px = std::int64_t{high} - low + 1;
    return static_cast<int>(std::clamp<std::int64_t>(px, 0, kMaxImageSide_px + 1));
  };
  found.header.size = {side(window.min.x, window.max.x), side(window.min.y, window.max.y)};
  if (window != file.header().displayWindow())
    return exr_fault("this EXR file has a part of its image only");
  found.header.channels = 1;
  found.header.bits = 32;
  found.header.is_float = true;
  found.header.format = "EXR";
  return found;
}

/// The library throws; `work` gets the open file.
template <typename Work>
auto with_file(std::string_view bytes, const Work& work)
    -> decltype(work(std::declval<Imf::InputFile&>())) {
  // Tables of rows are allocated as the header wants them, unless that is more than this.
  static const bool kIsLimited = [] {
    Imf::Header::setMaxImageSize(kMaxImageSide_px, kMaxImageSide_px);
    return true;
  }();
  static_cast<void>(kIsLimited);
  try {
    Source source(bytes);
    Imf::InputFile file(source, 0);  // no threads
    return work(file);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& fault) {
    return exr_fault("corrupt or truncated EXR (" + printable(fault.what()) + ")");
  }
}

}  // namespace

bool has_signature(std::string_view bytes) { return bytes.starts_with("\x76\x2f\x31\x01"); }

Result<ImageHeader> header(std::string_view bytes) {
  return with_file(bytes, [](Imf::InputFile& file) -> Result<ImageHeader> {
    const auto found = opened(file);
    if (!found.ok()) return found.error();
    return found->header;
  });
}

Status decode(std::string_view bytes, std::uint8_t* pixels) {
  return with_file(bytes, [pixels](Imf::InputFile& file) -> Status {
    const auto found = opened(file);
    if (!found.ok()) return found.error();
    const auto& window = file.header().dataWindow();
    const auto row_bytes = sizeof(float) * static_cast<std::size_t>(found->header.size.width);
    Imf::FrameBuffer rows;
    rows.insert(found->channel,
                Imf::Slice::Make(Imf::FLOAT, pixels, window.min, found->header.size.width,
                                 found->header.size.height, sizeof(float), row_bytes));
    file.setFrameBuffer(rows);
    file.readPixels(window.min.y, window.max.y);
    return Ok{};
  });
}

}  // namespace ygslam::exr
