#include "segment/people_input.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace ygslam {
namespace {

/// The depth of the frames of training/golden.py.
void draw(DepthImage& depth_m) {
  for (int v = 0; v < depth_m.height(); ++v) {
    for (int u = 0; u < depth_m.width(); ++u) {
      int mm =
          1500 + 3 * u + 5 * v + ((u / 20 + v / 15) % 3 == 0 ? 700 : 0) + (31 * u + 17 * v) % 7;
      if ((7 * u + 13 * v) % 11 == 0 || (u / 40 + v / 30) % 5 == 0) mm = 0;
      depth_m.at(u, v) = static_cast<float>(mm) / 1000.0F;
    }
  }
}

TEST(PeopleInput, IsTheDepthThatTheNetworkWasTrainedOn) {
  std::ifstream file("training/prepared.json");
  const auto golden = nlohmann::json::parse(file);
  const std::size_t stride = golden["stride"];
  for (const auto& frame : golden["frames"]) {
    CameraConfig camera;
    camera.width = frame["width"], camera.height = frame["height"];
    camera.fx = frame["fx"], camera.fy = frame["fy"];
    camera.cx = frame["cx"], camera.cy = frame["cy"];
    DepthImage depth_m(camera.width, camera.height);
    draw(depth_m);
    std::vector<float> planes(kPeopleChannels * kPeopleCells, NAN);
    PeopleInput input(camera);
    input.fill(depth_m, planes.data());
    const std::vector<double> values = frame["values"];
    ASSERT_EQ(values.size(), (planes.size() + stride - 1) / stride);
    for (std::size_t i = 0; i < values.size(); ++i)
      ASSERT_NEAR(planes[i * stride], values[i], 1e-4) << camera.width << " " << i * stride;
    for (int c = 0; c < kPeopleChannels; ++c) {
      const auto plane = planes.begin() + c * kPeopleCells;
      EXPECT_NEAR(std::accumulate(plane, plane + kPeopleCells, 0.0), frame["sums"][c], 0.05)
          << camera.width << " " << c;
    }
  }
}

TEST(PeopleInput, ImagesOfAnySizeFit) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {2, 480}, {640, 3}, {161, 121}, {1281, 719}, {4000, 3000}}) {
    CameraConfig camera;
    camera.fx = camera.fy = 500, camera.cx = width / 2.0, camera.cy = height / 2.0;
    camera.width = width, camera.height = height;
    std::vector<float> planes(kPeopleChannels * kPeopleCells, NAN);
    PeopleInput input(camera);
    input.fill(DepthImage(width, height, 2.0F), planes.data());
    const PeopleGrid& grid = input.grid();
    EXPECT_GE(std::max(grid.columns, grid.rows), 1);
    const auto measured = std::count(input.depth_m().begin(), input.depth_m().end(), 2.0F);
    EXPECT_EQ(measured, grid.columns * grid.rows);
    for (const float value : planes) ASSERT_TRUE(std::isfinite(value));
  }
}

}  // namespace
}  // namespace ygslam
