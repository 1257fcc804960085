#include "segment/known_person.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/memory.hpp"
#include "segment/openvino_network.hpp"
#include "segment/people_input.hpp"

namespace ygslam {
namespace {

// The people network reaches .92 in f32, bf16 and int8; OpenVINO on an ARM processor with SVE
// called 4.5 times as many pixels people as there were, which is .22 at best.
constexpr double kLeastOverlap = 0.75;

constexpr float kEye_m = 1.4F;  // above the floor; the camera looks level
constexpr float kWall_m = 4.0F;
constexpr float kPersonAway_m = 2.5F, kPersonAside_m = 0.5F;

/// Of the body, which faces the camera and whose feet are below the image.
struct Ellipsoid {
  float aside, up;           // of its centre: from the body's middle; above the floor [m]
  float across, tall, deep;  // semi-axes [m]
};
constexpr std::array<Ellipsoid, 10> kBody{{
    {0, 1.62F, .085F, .12F, .10F},      // head
    {0, 1.47F, .06F, .10F, .06F},       // neck
    {0, 1.22F, .19F, .30F, .13F},       // chest
    {0, .95F, .17F, .16F, .13F},        // hips
    {-.23F, 1.12F, .055F, .34F, .06F},  // arms
    {.23F, 1.12F, .055F, .34F, .06F},
    {-.10F, .62F, .085F, .34F, .09F},  // thighs
    {.10F, .62F, .085F, .34F, .09F},
    {-.10F, .26F, .06F, .27F, .065F},  // shanks
    {.10F, .26F, .06F, .27F, .065F},
}};

float square(float x) { return x * x; }

/// Depth [m] at which the ray through (x, y, 1) meets a part of the body; beyond the wall: nowhere.
float depth_of(const Ellipsoid& part, float x, float y) {
  const std::array ray{x / part.across, y / part.tall, 1 / part.deep};
  const std::array centre{(part.aside + kPersonAside_m) / part.across,
                          (kEye_m - part.up) / part.tall, kPersonAway_m / part.deep};
  float a = 0;
  float b = 0;
  float c = -1;
  for (std::size_t i = 0; i < ray.size(); ++i) {
    a += square(ray[i]);
    b += ray[i] * centre[i];
    c += square(centre[i]);
  }
  const float root = b * b - a * c;
  return root > 0 ? (b - std::sqrt(root)) / a : 2 * kWall_m;
}

}  // namespace

KnownPerson draw_known_person() {
  KnownPerson known;
  known.frame.id = FrameId{0};
  known.camera.width = kPeopleColumns;
  known.camera.height = kPeopleRows;
  known.camera.fx = known.camera.fy = 131.25;
  known.camera.cx = 79.5;
  known.camera.cy = 59.5;
  known.frame.colour = ColourImage(kPeopleColumns, kPeopleRows);
  known.frame.depth_m = DepthImage(kPeopleColumns, kPeopleRows);
  known.person = GreyImage(kPeopleColumns, kPeopleRows);
  for (int v = 0; v < kPeopleRows; ++v) {
    for (int u = 0; u < kPeopleColumns; ++u) {
      const auto x = static_cast<float>((u - known.camera.cx) / known.camera.fx);
      const auto y = static_cast<float>((v - known.camera.cy) / known.camera.fy);
      float depth_m = y * kWall_m > kEye_m ? kEye_m / y : kWall_m;  // floor or wall
      for (const Ellipsoid& part : kBody) {
        const float part_m = depth_of(part, x, y);
        if (part_m >= depth_m) continue;
        depth_m = part_m;
        known.person.at(u, v) = 1;
      }
      known.frame.depth_m.at(u, v) = depth_m;
    }
  }
  return known;
}

Result<double> overlap_with(const KnownPerson& known, Segmenter& people) {
  const auto found = people.segment(known.frame);
  if (!found.ok()) return found.error();
  int both = 0;
  int either = 0;
  for (int v = 0; v < kPeopleRows; ++v) {
    for (int u = 0; u < kPeopleColumns; ++u) {
      const bool is_found = found->ids.at(u, v) > 0;
      const bool is_drawn = known.person.at(u, v) > 0;
      both += is_found && is_drawn ? 1 : 0;
      either += is_found || is_drawn ? 1 : 0;
    }
  }
  return static_cast<double>(both) / either;
}

Status check_finds(const KnownPerson& known, Segmenter& people) {
  const auto overlap = overlap_with(known, people);
  if (overlap.ok() && *overlap >= kLeastOverlap) return Ok{};
  if (!overlap.ok()) require_memory(kAmpleMemory_bytes);
  const std::string what =
      overlap.ok() ? fmt::format("a drawn person is found with an IoU of {:.2f}, {} is the least",
                                 *overlap, kLeastOverlap)
                   : overlap.error().message;
  return Error{ErrorKind::kModel, "OpenVINO computes nonsense on this processor (" + what +
                                      "): use --segmenter none or --segmenter masks:DIR"};
}

}  // namespace ygslam
