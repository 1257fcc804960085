#include "segment/file_weights.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <openvino/core/model.hpp>
#include <openvino/op/constant.hpp>
#include <openvino/runtime/core.hpp>
#include <string>
#include <vector>

#include "segment/embedded_network.hpp"
#include "segment/openvino_network.hpp"
#include "segment/test_network.hpp"

namespace ygslam {
namespace {

/// The built-in network as a file.
class FileWeights : public ::testing::Test {
 protected:
  FileWeights()
      : file_(std::filesystem::temp_directory_path() /
              ("ygslam_weights_" + std::to_string(getpid()) + ".onnx")) {}
  ~FileWeights() override { std::filesystem::remove(file_); }
  void SetUp() override {
    const auto network = embedded_network("people.onnx");
    if (!network) GTEST_SKIP() << "built without the network";
    bytes_ = *network;
    write(bytes_);
  }
  void write(const std::string& bytes) const { std::ofstream(file_, std::ios::binary) << bytes; }
  [[nodiscard]] std::shared_ptr<ov::Model> read() const {
    return ov::Core().read_model(bytes_, ov::Tensor());
  }

  std::filesystem::path file_;
  std::string bytes_;
};

/// Where in the file constants are that lie there, one after the other in no order.
std::vector<std::string_view> lying_in(const FileView& view, const ov::Model& network) {
  std::vector<std::string_view> found;
  for (const auto& op : network.get_ops()) {
    const auto constant = ov::as_type_ptr<ov::op::v0::Constant>(op);
    if (!constant) continue;
    const auto* at = static_cast<const char*>(constant->get_data_ptr());
    const std::string_view file = view.bytes();
    if (at >= file.data() && at < file.data() + file.size())
      found.emplace_back(at, constant->get_byte_size());
  }
  return found;
}

std::vector<float> answer(ov::InferRequest request) {
  ov::Tensor input = request.get_input_tensor();
  for (std::size_t i = 0; i < input.get_size(); ++i)
    input.data<float>()[i] = std::sin(0.37F * static_cast<float>(i));
  request.infer();
  const ov::Tensor output = request.get_output_tensor();
  return {output.data<float>(), output.data<float>() + output.get_size()};
}

Result<ov::InferRequest> compiled(std::shared_ptr<ov::Model> network) {
  return compile_network(std::move(network), Precision::kF32, 1, "test");
}

TEST_F(FileWeights, LieInTheFileAndAreGivenBackOnceTheNetworkIsCompiled) {
  auto network = read();
  const auto view = leave_weights_in(file_, *network);
  ASSERT_NE(view, nullptr);
  std::size_t size = 0;
  for (const auto& weights : lying_in(*view, *network)) size += weights.size();
  EXPECT_GT(size, view->bytes().size() / 2);
  auto left = compiled(std::move(network));
  ASSERT_TRUE(left.ok()) << left.error().message;
  view->give_back();
  auto as_read = compiled(read());
  ASSERT_TRUE(as_read.ok()) << as_read.error().message;
  EXPECT_EQ(answer(*left), answer(*as_read));
}

TEST_F(FileWeights, StayWhatWasReadWhereTheFileSaysOtherwise) {
  const auto network = read();
  std::string other = bytes_;
  {
    const auto view = leave_weights_in(file_, *network);
    ASSERT_NE(view, nullptr);
    for (const auto& weights : lying_in(*view, *network))
      other[static_cast<std::size_t>(weights.data() - view->bytes().data())] ^= '\1';
  }
  write(other);
  EXPECT_EQ(leave_weights_in(file_, *read()), nullptr) << "weights of another training";
  for (const std::string& bytes : {std::string("no network"), std::string(100000, '\x3a'),
                                   std::string(100000, '\xff'), testing::people_onnx()}) {
    write(bytes);
    EXPECT_EQ(leave_weights_in(file_, *read()), nullptr);
  }
  std::filesystem::remove(file_);
  EXPECT_EQ(leave_weights_in(file_, *read()), nullptr);
}

TEST_F(FileWeights, AreNotTakenFromAFileCutShort) {
  for (std::size_t size = 0; size < bytes_.size() * 9 / 10; size += bytes_.size() / 20) {
    write(bytes_.substr(0, size));
    EXPECT_EQ(leave_weights_in(file_, *read()), nullptr) << size;
  }
}

}  // namespace
}  // namespace ygslam
