#include "segment/file_weights.hpp"

#include <cstdint>
#include <openvino/core/graph_util.hpp>
#include <openvino/core/model.hpp>
#include <openvino/core/rt_info.hpp>
#include <openvino/op/constant.hpp>
#include <optional>
#include <string_view>
#include <unordered_map>

namespace ygslam {
namespace {

// Smaller ones, some of which are looked at for each image, are a twentieth of YOLOv8n-seg's.
constexpr std::size_t kLarge_bytes = std::size_t{64} << 10;

/// The fields of a protocol buffer's message (https://protobuf.dev/programming-guides/encoding), up
/// to the first that makes no sense.
class Fields {
 public:
  explicit Fields(std::string_view message) : rest_(message) {}

  struct Field {
    std::uint64_t number = 0;
    std::string_view bytes;  ///< of a field that has a length
  };
  std::optional<Field> next() {
    const auto key = varint();
    if (!key) return std::nullopt;
    constexpr unsigned kVarint = 0, kFixed64 = 1, kBytes = 2, kFixed32 = 5;
    std::optional<std::uint64_t> size = 0;
    switch (*key & 7) {
      case kVarint:
        if (!varint()) return std::nullopt;
        break;
      case kFixed64:
        size = 8;
        break;
      case kBytes:
        size = varint();
        break;
      case kFixed32:
        size = 4;
        break;
      default:
        return std::nullopt;
    }
    if (!size || *size > rest_.size()) return std::nullopt;
    const Field field{*key >> 3, rest_.substr(0, *size)};
    rest_.remove_prefix(*size);
    return field;
  }

 private:
  std::optional<std::uint64_t> varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64 && !rest_.empty(); shift += 7) {
      const auto byte = static_cast<unsigned char>(rest_.front());
      rest_.remove_prefix(1);
      value |= std::uint64_t{byte & 127U} << shift;
      if (byte < 128) return value;
    }
    return std::nullopt;
  }

  std::string_view rest_;
};

/// The large tensors of an ONNX file, by name: ModelProto.graph.initializer[].raw_data of
/// onnx.proto.
std::unordered_map<std::string_view, std::string_view> tensors_of(std::string_view file) {
  constexpr std::uint64_t kGraph = 7, kInitializer = 5, kName = 8, kRawData = 9;
  std::unordered_map<std::string_view, std::string_view> tensors;
  for (Fields model(file); const auto graph = model.next();) {
    if (graph->number != kGraph) continue;
    for (Fields parts(graph->bytes); const auto tensor = parts.next();) {
      if (tensor->number != kInitializer) continue;
      std::string_view name;
      std::string_view data;
      for (Fields fields(tensor->bytes); const auto field = fields.next();) {
        if (field->number == kName) name = field->bytes;
        if (field->number == kRawData) data = field->bytes;
      }
      if (data.size() >= kLarge_bytes) tensors.emplace(name, data);
    }
  }
  return tensors;
}

}  // namespace

std::shared_ptr<const FileView> leave_weights_in(const std::filesystem::path& onnx_file,
                                                 ov::Model& network) {
  const auto view = FileView::open(onnx_file);
  if (!view) return nullptr;
  const auto tensors = tensors_of(view->bytes());
  bool any = false;
  for (const auto& op : network.get_ops()) {
    const auto read = ov::as_type_ptr<ov::op::v0::Constant>(op);
    if (!read) continue;
    const auto tensor = tensors.find(read->get_friendly_name());
    if (tensor == tensors.end() || std::string_view(static_cast<const char*>(read->get_data_ptr()),
                                                    read->get_byte_size()) != tensor->second)
      continue;
    const auto left = std::make_shared<ov::op::v0::Constant>(
        read->get_element_type(), read->get_shape(), tensor->second.data(),
        std::const_pointer_cast<FileView>(view));
    left->set_friendly_name(read->get_friendly_name());
    ov::copy_runtime_info(read, left);
    ov::replace_node(read, left);
    any = true;
  }
  return any ? view : nullptr;
}

}  // namespace ygslam
