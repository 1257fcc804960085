#include "segment/known_person.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <openvino/op/constant.hpp>
#include <openvino/op/convolution.hpp>
#include <openvino/op/multiply.hpp>
#include <openvino/pass/serialize.hpp>
#include <openvino/runtime/core.hpp>
#include <sstream>

#include "segment/cpu_features.hpp"
#include "segment/embedded_network.hpp"
#include "segment/people_network.hpp"
#include "segment/test_network.hpp"

namespace ygslam {
namespace {

using ::testing::HasSubstr;

std::unique_ptr<Segmenter> people_of(std::string_view network, const KnownPerson& known,
                                     Precision precision = Precision::kF32,
                                     std::string_view weights = {}) {
  auto made = make_people_segmenter(network, known.camera, {precision, 1}, weights);
  if (!made.ok()) throw std::runtime_error(made.error().message);
  return std::move(made).value();
}

void expect_refused(const KnownPerson& known, Segmenter& people, const std::string& why) {
  const Status status = check_finds(known, people);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::kModel);
  for (const char* part : {"OpenVINO computes nonsense on this processor", why.c_str(),
                           "use --segmenter none or --segmenter masks:DIR"})
    EXPECT_THAT(status.error().message, HasSubstr(part));
  EXPECT_EQ(status.error().message.find('\n'), std::string::npos);
}

TEST(KnownPerson, StandsInTheRoomAtAPersonsSize) {
  const KnownPerson known = draw_known_person();
  const auto& depth_m = known.frame.depth_m;
  EXPECT_TRUE(std::ranges::all_of(depth_m, [](float z) { return z > 1 && z <= 4; }));
  const auto cells = std::ranges::count(known.person, 1);
  EXPECT_NEAR(static_cast<double>(cells), 1500, 100);
  int top = known.person.height();
  for (int v = 0; v < known.person.height(); ++v) {
    for (int u = 0; u < known.person.width(); ++u) {
      if (known.person.at(u, v) == 0) continue;
      EXPECT_NEAR(depth_m.at(u, v), 2.5, 0.25);
      top = std::min(top, v);
    }
  }
  EXPECT_NEAR(1.4 + (known.camera.cy - top) * 2.5 / known.camera.fy, 1.74, 0.02) << "height";
  EXPECT_EQ(known.person.at(101, 119), 1) << "the feet are out of view";
}

TEST(KnownPerson, IsFoundInEveryPrecisionThatThisProcessorHas) {
  const KnownPerson known = draw_known_person();
  constexpr double kReached = 0.9;  // .92 in each, where .75 is asked
  if (const auto network = embedded_network("people.onnx")) {
    EXPECT_GT(*overlap_with(known, *people_of(*network, known)), kReached);
    if (cpu_bf16() != Bf16::kNone) {
      EXPECT_GT(*overlap_with(known, *people_of(*network, known, Precision::kBf16)), kReached);
    }
  }
  const auto network = embedded_network("people_int8.xml");
  const auto weights = embedded_network("people_int8.bin");
  if (network && weights) {
    EXPECT_GT(*overlap_with(known, *people_of(*network, known, Precision::kInt8, *weights)),
              kReached);
  }
}

TEST(KnownPerson, ANetworkThatSeesPeopleEverywhereOrNowhereIsRefused) {
  const KnownPerson known = draw_known_person();
  expect_refused(known, *people_of(testing::people_onnx(4), known), "an IoU of 0.08");
  expect_refused(known, *people_of(testing::people_onnx(-4), known), "an IoU of 0.00");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  expect_refused(known, *people_of(testing::people_onnx(nan), known), "makes no sense");
}

/// A processor on which a factor creeps into a convolution: of the network built in, the one whose
/// name has `layer` in it; empty: into all.
struct Ir {
  std::string network, weights;
};
Ir miscomputed(std::string_view onnx, const std::string& layer, float factor) {
  const auto model = ov::Core().read_model(std::string(onnx), ov::Tensor());
  int spoiled = 0;
  for (const auto& op : model->get_ordered_ops()) {
    if (!ov::is_type<ov::op::v1::Convolution>(op) ||
        op->get_friendly_name().find(layer) == std::string::npos)
      continue;
    const auto kernel = op->input_value(1);
    const auto by = ov::op::v0::Constant::create(kernel.get_element_type(), {}, {factor});
    op->input(1).replace_source_output(std::make_shared<ov::op::v1::Multiply>(kernel, by));
    ++spoiled;
  }
  if (spoiled == 0) throw std::runtime_error("no such layer: " + layer);
  std::ostringstream network;
  std::ostringstream weights;
  ov::pass::Serialize(network, weights).run_on_model(model);
  return {network.str(), weights.str()};
}

TEST(KnownPerson, WrongArithmeticIsRefused) {
  const auto network = embedded_network("people.onnx");
  if (!network) GTEST_SKIP() << "built without the network";
  const KnownPerson known = draw_known_person();
  const auto check = [&](const std::string& layer, float factor) {
    const Ir wrong = miscomputed(*network, layer, factor);
    const auto people = people_of(wrong.network, known, Precision::kF32, wrong.weights);
    return check_finds(known, *people);
  };
  EXPECT_TRUE(check("", 1).ok()) << "nothing is wrong with it";
  for (const auto& [layer, factor] : {std::pair{"", -1.0F},
                                      {"", 0.5F},
                                      {"people.1", -1.0F},
                                      {"to_half.0", 0.0F},
                                      {"join_eighth/mix", -1.0F},
                                      {"to_sixteenth.2", 0.0F}}) {
    const Status found = check(layer, factor);
    ASSERT_FALSE(found.ok()) << layer << " by " << factor;
    EXPECT_THAT(found.error().message, HasSubstr("a drawn person is found with an IoU of 0."));
  }
}

}  // namespace
}  // namespace ygslam
