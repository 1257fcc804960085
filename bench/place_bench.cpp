// Places found in a map by single frames, without a guess and without the frames before them: how
// many, and how long it takes. The poses found go to a file for `ygslam eval`.
//
//   place_bench MAP SEQUENCE [--masks DIR] [--from N] [--to N] [--out found.txt]
//   place_bench --keyframes 5000      # times of a map made up
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>

#include "core/histogram.hpp"
#include "core/rng.hpp"
#include "features/attach.hpp"
#include "features/orb.hpp"
#include "geometry/geometry_testing.hpp"
#include "io/atomic_file.hpp"
#include "io/frame_loader.hpp"
#include "io/trajectory.hpp"
#include "io/tum_sequence.hpp"
#include "loop/place_finder.hpp"
#include "map_file/map_file.hpp"
#include "motion/masks/mask_labels.hpp"
#include "segment/recorded_masks.hpp"
#include "system/slam_config.hpp"

namespace {

using namespace ygslam;

struct Options {
  std::string map, sequence, masks, out;
  std::size_t from = 0, to = 0;
  int keyframes = 0;
};

void print(const char* name, const Histogram& times_ms) {
  std::printf("%-10s median %.2f ms, p95 %.2f, max %.2f\n", name, times_ms.percentile(0.5),
              times_ms.percentile(0.95), times_ms.max());
}

/// Per feature 0 where a mask says that it moves.
std::vector<float> static_weight(const Features& features, const RgbdFrame& frame,
                                 Segmenter* segmenter, const MaskConfig& config) {
  std::vector<float> weight(features.size(), 1);
  if (!segmenter) return weight;
  const auto masks = segmenter->segment(frame);
  if (!masks.ok()) return weight;
  const auto labels = label_by_mask(features, *masks, CoarseDepth(frame.depth_m), config);
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (labels[i].label == SemanticLabel::kMovable) weight[i] = 0;
  return weight;
}

Result<int> find_frames(const Options& options) {
  const auto sequence = open_tum_sequence(options.sequence);
  if (!sequence.ok()) return sequence.error();
  const auto config = resolved(SlamConfig{});
  if (!config.ok()) return config.error();
  const Camera camera(sequence->camera);
  OrbExtractor orb(config->orb);
  const auto map = load_map(options.map, camera, orb.scales());
  if (!map.ok()) return map.error();
  std::unique_ptr<Segmenter> segmenter;
  if (!options.masks.empty()) {
    auto opened = make_recorded_segmenter(options.masks);
    if (!opened.ok()) return opened.error();
    segmenter = std::move(opened).value();
  }
  Histogram rebuild_ms, query_ms, find_ms;
  PlaceIndex index(config->loop.index);
  const ScopedTimer rebuilding;
  index.rebuild(*map);
  rebuild_ms.add(rebuilding.wall_ms());
  const PlaceFinder finder(config->loop.finder, camera);
  std::vector<StampedPose> found;
  const std::size_t to =
      options.to > 0 ? std::min(options.to, sequence->pairs.size()) : sequence->pairs.size();
  for (std::size_t i = options.from; i < to; ++i) {
    const auto frame = load_frame(*sequence, i, config->depth);
    if (!frame.ok()) return frame.error();
    Features features = orb.extract(frame->grey);
    attach_geometry(features, camera, frame->depth_m, orb.scales());
    const auto weight =
        static_weight(features, *frame, segmenter.get(), config->dynamic.masks.mask);
    const FeatureGrid grid(features, camera.ideal_bounds());
    const ScopedTimer querying;
    (void)index.query(*map, features, weight);
    query_ms.add(querying.wall_ms());
    const ScopedTimer finding;
    const auto place = finder.find_one(*map, index, {features, grid, weight}, 0);
    find_ms.add(finding.wall_ms());
    if (place) found.push_back({frame->stamp, place->T_camera_world.inverse()});
  }
  const std::size_t frames = to - options.from;
  std::printf("%zu keyframes, %zu landmarks in the index; %zu of %zu frames found (%.1f %%)\n",
              map->keyframes().size(), index.size(), found.size(), frames,
              100.0 * static_cast<double>(found.size()) / static_cast<double>(frames));
  print("rebuild", rebuild_ms);
  print("query", query_ms);
  print("find", find_ms);
  if (options.out.empty()) return 0;
  const Status written = write_file_atomically(options.out, format_tum(found, 6));
  if (!written.ok()) return written.error();
  return 0;
}

Descriptor random_descriptor(Rng& rng) {
  Descriptor d;
  for (auto& bits : d.bits) bits = rng.next();
  return d;
}

/// Keyframes that see 500 landmarks each, every landmark seen by five of them in a row.
int time_made_up(int keyframes) {
  constexpr int kFresh = 100, kSightings = 5, kBlurredBits = 25;
  const Camera camera = geometry_test::test_camera();
  Rng rng(1);
  Map map({8, 1.2});
  std::vector<Descriptor> descriptors;
  std::vector<LandmarkId> landmarks;
  const auto blurred = [&](Descriptor d) {
    for (int i = 0; i < kBlurredBits; ++i) d.bits[rng.below(4)] ^= 1ULL << rng.below(64);
    return d;
  };
  for (int k = 0; k < keyframes; ++k) {
    for (int i = 0; i < kFresh; ++i) descriptors.push_back(random_descriptor(rng));
    const std::size_t first = static_cast<std::size_t>(std::max(0, k - kSightings + 1)) * kFresh;
    auto features = std::make_shared<Features>();
    for (std::size_t i = first; i < descriptors.size(); ++i) {
      Feature f;
      f.uv_px = f.ideal_px = {static_cast<float>(rng.uniform(20, 620)),
                              static_cast<float>(rng.uniform(20, 460))};
      f.depth_m = 2;
      features->points.push_back(f);
      features->descriptors.push_back(blurred(descriptors[i]));
    }
    const KeyframeId id = map.next_keyframe_id();
    auto data = std::make_shared<KeyframeData>();
    data->id = id;
    data->features = features;
    map.add_keyframe(data, SE3(Mat3::Identity(), Vec3(0.2 * k, 0, 0)),
                     k ? KeyframeId(k - 1) : kNoKeyframe, std::vector<float>(features->size(), 1));
    for (std::uint32_t i = 0; i < features->size(); ++i) {
      const std::size_t at = first + i;
      if (at >= landmarks.size()) {
        landmarks.push_back(map.add_landmark(Vec3(-0.2 * k, 0, 2), id, i));
      } else {
        map.add_observation(landmarks[at], id, i);
      }
    }
  }
  PlaceIndex index;
  const ScopedTimer rebuilding;
  index.rebuild(map);
  std::printf("%d keyframes, %zu landmarks in the index, rebuilt in %.0f ms\n", keyframes,
              index.size(), rebuilding.wall_ms());
  const ScopedTimer starting;
  const PlaceIndex empty;
  std::printf("an empty index is there after %.2f ms\n", starting.wall_ms());
  Histogram query_ms, candidates_ms;
  int right = 0;
  constexpr int kQueries = 500;
  for (int q = 0; q < kQueries; ++q) {
    const auto at = rng.below(static_cast<std::uint32_t>(keyframes));
    Features view;  // half of it known, half of it new
    for (const Descriptor& d : map.keyframe(KeyframeId{at}).data->features->descriptors) {
      view.descriptors.push_back(blurred(d));
      view.descriptors.push_back(random_descriptor(rng));
    }
    view.points.resize(view.descriptors.size());
    const std::vector<float> weight(view.size(), 1);
    const ScopedTimer querying;
    const auto hits = index.query(map, view, weight);
    query_ms.add(querying.wall_ms());
    const ScopedTimer choosing;
    const auto places = index.candidates(map, hits, {}, 3);
    candidates_ms.add(choosing.wall_ms());
    const auto near = [&](const PlaceCandidate& p) {
      return std::abs(static_cast<int>(ygslam::index(p.keyframe)) - static_cast<int>(at)) < 5;
    };
    right += !places.empty() && near(places.front()) ? 1 : 0;
  }
  std::printf("%d of %d views of 1000 features: right keyframe first\n", right, kQueries);
  print("query", query_ms);
  print("candidates", candidates_ms);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app{"Places found by single frames"};
  app.add_option("map", o.map, "Map file")->type_name("FILE");
  app.add_option("sequence", o.sequence, "Recording")->type_name("DIR");
  app.add_option("--masks", o.masks, "Masks of the recording")->type_name("DIR");
  app.add_option("--from", o.from, "First pair")->type_name("N");
  app.add_option("--to", o.to, "One past the last pair")->type_name("N");
  app.add_option("--out", o.out, "Poses found, TUM format")->type_name("FILE");
  app.add_option("--keyframes", o.keyframes, "Times of a map made up with so many keyframes");
  CLI11_PARSE(app, argc, argv);
  if (o.keyframes > 0) return time_made_up(o.keyframes);
  const auto done = find_frames(o);
  if (done.ok()) return *done;
  std::fprintf(stderr, "error: %s\n", done.error().message.c_str());
  return static_cast<int>(done.error().kind);
}
