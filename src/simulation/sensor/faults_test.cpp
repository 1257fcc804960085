#include "simulation/sensor/faults.hpp"

#include "simulation/sequence/test_worlds.hpp"

namespace ygslam::sim {
namespace {

std::vector<SimulatedFrame> with_fault(const std::string& text) {
  SequenceOptions options = small_options(2, 10);
  options.width = 64;
  options.height = 48;
  Result<Fault> fault = parse_fault(text);
  CHECK(fault.ok(), text.c_str());
  options.faults = {*fault};
  return all_frames(open_or_die("static_xyz", options));
}

TEST(Faults, GrammarIsCheckedAndExplained) {
  EXPECT_TRUE(parse_fault("depth:stuck@12s+2s").ok());
  EXPECT_TRUE(parse_fault("both:drop=0.3@0+1.5").ok());
  for (const char* text : {"", "depth", "depth:stuck", "depth:stuck@1", "depth:melt@1+1",
                           "nose:off@1+1", "rgb:off@x+1", "rgb:off@1+-2", "rgb:off=nan@1+1"}) {
    const Result<Fault> fault = parse_fault(text);
    ASSERT_FALSE(fault.ok()) << text;
    EXPECT_EQ(fault.error().kind, ErrorKind::kUsage);
    EXPECT_NE(fault.error().message.find("stuck"), std::string::npos);
  }
}

TEST(Faults, ValuesWithoutSenseAreRefused) {
  for (const char* text : {"both:drop=1.5@1+1", "depth:scale=0@1+1", "rgb:slow=0@1+1",
                           "rgb:delayed=1e9@1+1", "rgb:black=3@1+1", "rgb:off@1+0"}) {
    const Result<Fault> fault = parse_fault(text);
    ASSERT_FALSE(fault.ok()) << text;
    EXPECT_EQ(fault.error().kind, ErrorKind::kUsage);
    EXPECT_NE(fault.error().message.find(text), std::string::npos);
  }
  EXPECT_TRUE(parse_fault("both:drop=1@0+1").ok());
}

TEST(Faults, StuckDepthRepeatsTheLastGoodImage) {
  const auto frames = with_fault("depth:stuck@1s+0.5s");
  EXPECT_FALSE(same_pixels(frames[8].frame->depth_m, frames[9].frame->depth_m));
  for (int i = 10; i < 15; ++i) {
    EXPECT_TRUE(same_pixels(frames[9].frame->depth_m, frames[i].frame->depth_m)) << i;
    EXPECT_FALSE(same_pixels(frames[9].frame->colour, frames[i].frame->colour)) << i;
  }
  EXPECT_FALSE(same_pixels(frames[9].frame->depth_m, frames[15].frame->depth_m));
}

TEST(Faults, DelayedColourShowsThePast) {
  const auto clean = with_fault("depth:off@100+1");
  const auto late = with_fault("rgb:delayed=0.2@1+1");
  EXPECT_TRUE(same_pixels(late[15].frame->colour, clean[13].frame->colour));
  EXPECT_TRUE(same_pixels(late[15].frame->depth_m, clean[15].frame->depth_m));
}

TEST(Faults, OffIsNotDeliveredAndScaleMultiplies) {
  for (const SimulatedFrame& frame : with_fault("rgb:off@1+0.5")) {
    EXPECT_EQ(frame.delivery.colour, frame.index < 10 || frame.index >= 15);
    EXPECT_TRUE(frame.delivery.depth);
  }
  const auto scaled = with_fault("depth:scale=5@0+9");
  EXPECT_NEAR(scaled[3].frame->depth_m.at(30, 20), 5 * scaled[3].depth_true_m.at(30, 20), 0.01F);
}

TEST(Faults, DepthThatIsOffComesWithNothingMeasuredAndEmptyLosesItsShareOfThePixels) {
  const auto measured = [](const SimulatedFrame& frame) {
    const DepthImage& depth_m = frame.frame->depth_m;
    const auto count = std::ranges::count_if(depth_m, [](float d) { return d > 0; });
    return static_cast<double>(count) / static_cast<double>(depth_m.size());
  };
  const auto off = with_fault("depth:off@1+0.5");
  const auto sparse = with_fault("depth:empty=0.9@1+0.5");
  for (int i = 0; i < 20; ++i) {
    const bool is_faulty = i >= 10 && i < 15;
    EXPECT_TRUE(off[i].delivery.depth && off[i].delivery.colour);
    EXPECT_EQ(measured(off[i]) == 0, is_faulty) << i;
    const double whole = is_faulty ? 0.1 * measured(off[i - 10]) : measured(off[i]);
    EXPECT_NEAR(measured(sparse[i]), whole, 0.03) << i;
  }
}

TEST(Faults, DropsAreAsFrequentAsAskedAndRepeat) {
  const auto count = [](const std::vector<SimulatedFrame>& frames) {
    return std::count_if(frames.begin(), frames.end(),
                         [](const SimulatedFrame& f) { return !f.delivery.frame; });
  };
  const auto once = count(with_fault("both:drop=0.5@0+9"));
  EXPECT_GT(once, 3);
  EXPECT_LT(once, 17);
  EXPECT_EQ(once, count(with_fault("both:drop=0.5@0+9")));
}

TEST(Faults, DisorderSwapsNeighbouringStamps) {
  const auto frames = with_fault("both:disorder@1+0.4");
  EXPECT_GT(frames[10].frame->stamp, frames[11].frame->stamp);
  EXPECT_LT(frames[9].frame->stamp, frames[11].frame->stamp);
  EXPECT_LT(frames[14].frame->stamp, frames[15].frame->stamp);
}

TEST(Faults, BlackAndWhiteImagesHaveNoDepth) {
  for (const auto& [text, value] :
       {std::pair{"both:black@1+0.5", 0}, std::pair{"both:white@1+0.5", 255}}) {
    const auto frames = with_fault(text);
    for (const Rgb8& p : frames[12].frame->colour) ASSERT_EQ(p.g, value);
    for (const float d : frames[12].frame->depth_m) ASSERT_EQ(d, 0.0F);
  }
}

}  // namespace
}  // namespace ygslam::sim
