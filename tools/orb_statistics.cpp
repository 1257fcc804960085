// How a sequence looks to ORB: features per frame, matches to the frame ten later, and how many of
// them are right by the true poses and depth. For comparing rendered with recorded sequences:
//   orb_statistics SEQUENCE...     (TUM layout with groundtruth.txt)
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "features/attach.hpp"
#include "features/matcher.hpp"
#include "features/orb.hpp"
#include "io/frame_loader.hpp"
#include "io/trajectory_formats.hpp"
#include "io/tum_sequence.hpp"

namespace ygslam {
namespace {

constexpr double kRight_px = 4;  // a match nearer than this to its true place is right

struct Sampling {
  std::size_t apart = 10;   // frames between the two images
  std::size_t stride = 15;  // frames between the pairs
};

std::optional<SE3> pose_at(const std::vector<StampedPose>& poses, Timestamp stamp) {
  const auto nearest =
      std::min_element(poses.begin(), poses.end(), [&](const auto& a, const auto& b) {
        return std::abs(a.stamp.ns - stamp.ns) < std::abs(b.stamp.ns - stamp.ns);
      });
  if (nearest == poses.end() || std::abs(nearest->stamp.ns - stamp.ns) > 20'000'000)
    return std::nullopt;
  return nearest->T_world_camera;
}

int correct(const Features& a, const Features& b, const std::vector<Match>& matches,
            const SE3& T_b_a, const Camera& camera) {
  int right = 0;
  for (const Match& match : matches) {
    const Feature& from = a.points[match.a];
    if (from.depth_m <= 0) continue;
    const Vec3 p_b =
        T_b_a * camera.unproject(from.ideal_px.cast<double>(), static_cast<double>(from.depth_m));
    if (p_b.z() < 0.1) continue;
    if ((camera.project(p_b) - b.points[match.b].ideal_px.cast<double>()).norm() < kRight_px)
      ++right;
  }
  return right;
}

int measure(const char* folder, const Sampling& sampling) {
  const auto sequence = open_tum_sequence(folder);
  if (!sequence || !sequence->groundtruth) {
    std::fprintf(stderr, "%s: %s\n", folder,
                 sequence ? "no groundtruth.txt" : sequence.error().message.c_str());
    return 4;
  }
  const auto truth = read_tum_trajectory(*sequence->groundtruth);
  if (!truth) return 4;
  const Camera camera(sequence->camera);
  OrbExtractor orb(OrbConfig{});
  double features = 0, matched = 0, right = 0;
  int frames = 0, pairs = 0;
  for (std::size_t i = 0; i + sampling.apart < sequence->pairs.size(); i += sampling.stride) {
    auto a = load_frame(*sequence, i);
    auto b = load_frame(*sequence, i + sampling.apart);
    if (!a || !b) continue;
    Features fa = orb.extract(a->grey);
    Features fb = orb.extract(b->grey);
    attach_geometry(fa, camera, a->depth_m, orb.scales());
    attach_geometry(fb, camera, b->depth_m, orb.scales());
    ++frames;
    features += static_cast<double>(fa.size());
    const auto T_world_a = pose_at(*truth, a->stamp);
    const auto T_world_b = pose_at(*truth, b->stamp);
    if (!T_world_a || !T_world_b) continue;
    const auto matches = match_brute_force(fa, fb);
    ++pairs;
    matched += static_cast<double>(matches.size());
    right += correct(fa, fb, matches, T_world_b->inverse() * *T_world_a, camera);
  }
  std::printf("| %s | %.0f | %.0f | %.0f |\n", std::filesystem::path(folder).filename().c_str(),
              features / std::max(1, frames), matched / std::max(1, pairs),
              right / std::max(1, pairs));
  return 0;
}

}  // namespace
}  // namespace ygslam

int main(int argc, char** argv) {
  ygslam::Sampling sampling;
  std::vector<const char*> folders;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    std::size_t* number = word == "--apart"    ? &sampling.apart
                          : word == "--stride" ? &sampling.stride
                                               : nullptr;
    if (number == nullptr) {
      folders.push_back(argv[i]);
      continue;
    }
    const int value = i + 1 < argc ? std::atoi(argv[++i]) : 0;
    if (value < 1) {
      std::fprintf(stderr, "orb_statistics: %s wants a number of frames\n", word.c_str());
      return 2;
    }
    *number = static_cast<std::size_t>(value);
  }
  std::printf("| sequence | ORB features | matches | correct |\n|---|---|---|---|\n");
  int worst = 0;
  for (const char* folder : folders) worst = std::max(worst, ygslam::measure(folder, sampling));
  return worst;
}
