// Files whose checksums are right and whose content is not: a checksum is no validation.
#include <limits>

#include "map/map_fields.hpp"
#include "map_file/map_file_testing.hpp"

namespace ygslam {
namespace {

using namespace map_file_test;  // NOLINT(google-build-using-namespace): its own helpers
using map_file::RowKey;
using map_file::Table;
using testing::TempFolder;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class MapContent : public ::testing::Test {
 protected:
  MapContent() : path_(folder_.path() / "room.map"), map_(some_map(9)) {
    EXPECT_TRUE(save_map(path_, map_, camera()).ok());
    whole_ = testing::read(path_);
  }
  void restore() { testing::write(path_, whole_); }
  template <typename T>
  void expect_refused_with(const RowKey& key, std::size_t at, T value, const std::string& cause) {
    restore();
    sign_number(path_, key, at, value);
    expect_refused(path_, cause);
  }
  /// Reads the landmarks of the only chunk, changes them and writes both rows again.
  void change_landmarks(
      const std::function<void(std::vector<Landmark>&, std::vector<std::uint8_t>&)>& change,
      const std::string& cause) {
    restore();
    std::vector<Landmark> landmarks;
    map_fields::LandmarkExtras extras;
    sign_row(path_, {Table::kLandmarks, 0}, [&](std::string& raw) {
      ArchiveReader in(raw);
      map_fields::landmarks(in, landmarks, extras);
    });
    sign_row(path_, {Table::kObservations, 0}, [&](std::string& raw) {
      ArchiveReader in(raw);
      map_fields::observations(in, landmarks);
    });
    change(landmarks, extras.sources);
    std::vector<const Landmark*> pointers;
    for (const Landmark& l : landmarks) pointers.push_back(&l);
    sign_row(path_, {Table::kLandmarks, 0}, [&](std::string& raw) {
      ArchiveWriter out;
      map_fields::landmarks(out, pointers, extras);
      raw = out.bytes();
    });
    sign_row(path_, {Table::kObservations, 0}, [&](std::string& raw) {
      ArchiveWriter out;
      map_fields::observations(out, pointers);
      raw = out.bytes();
    });
    SCOPED_TRACE(cause);
    expect_refused(path_, cause);
  }

  TempFolder folder_;
  fs::path path_;
  Map map_;
  std::string whole_;
};

TEST_F(MapContent, SigningAgainChangesNothing) {
  sign_row(path_, {Table::kPose, 0}, [](std::string&) {});
  sign_keyframe(path_, 1, 0, 0, map_.keyframe(KeyframeId{1}).data->stamp.ns);
  const auto back = load(path_);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(to_bytes(*back), to_bytes(map_));
}

TEST_F(MapContent, PosesAreRotations) {
  expect_refused_with(RowKey{Table::kPose, 0}, 0, kNan, "pose 0: a number is not finite");
  expect_refused_with(RowKey{Table::kPose, 0}, 88, std::numeric_limits<double>::infinity(),
                      "pose 0: a number is not finite");
  expect_refused_with(RowKey{Table::kPose, 0}, 0, 1.001, "pose 0: a pose is no rotation");
  expect_refused_with(RowKey{Table::kPose, 0}, 72, 1e155, "pose 0: a position is farther");
  restore();  // a reflection is orthogonal, too
  sign_row(path_, {Table::kPose, 0}, [](std::string& raw) {
    for (std::size_t i = 0; i < 9; ++i) {
      double value = 0;
      std::memcpy(&value, raw.data() + 8 * i, 8);
      value = -value;
      std::memcpy(raw.data() + 8 * i, &value, 8);
    }
  });
  expect_refused(path_, "pose 0: a pose is no rotation");
  restore();
  sign_row(path_, {Table::kPose, 0}, [](std::string& raw) { raw += '\0'; });
  expect_refused(path_, "pose 0: bytes left over");
  restore();
  sign_row(path_, {Table::kPose, 0}, [](std::string& raw) { raw.pop_back(); });
  expect_refused(path_, "pose 0: cut short");
}

TEST_F(MapContent, ParentsAreOlder) {
  const auto stamp = [&](std::uint32_t id) { return map_.keyframe(KeyframeId{id}).data->stamp.ns; };
  sign_keyframe(path_, 0, -1, 1, stamp(0));  // 1 is the child of 0
  expect_refused(path_, "keyframe 0: its parent 1 is not there or not older");
  restore();
  sign_keyframe(path_, 1, 0, 1, stamp(1));
  expect_refused(path_, "keyframe 1: its parent 1 is not there or not older");
  restore();
  sign_keyframe(path_, 1, 0, 77, stamp(1));
  expect_refused(path_, "keyframe 1: its parent 77");
  restore();
  sign_keyframe(path_, 1, 0, -2, stamp(1));
  expect_refused(path_, "keyframe 1: no parent can be that");
  restore();
  sign_keyframe(path_, 1, 0, std::numeric_limits<std::int64_t>::max(), stamp(1));
  expect_refused(path_, "keyframe 1: no parent can be that");
  const std::size_t first = sizeof(std::uint32_t);
  const KeyframeId removed = map_.removed_keyframes().front().id;
  expect_refused_with(RowKey{Table::kRemoved, 0}, first + 4, removed, "its parent");
  expect_refused_with(RowKey{Table::kRemoved, 0}, first + 4, KeyframeId{88}, "its parent");
  expect_refused_with(RowKey{Table::kRemoved, 0}, first, kNoKeyframe, "another chunk");
  expect_refused_with(RowKey{Table::kRemoved, 0}, first, KeyframeId{0}, "removed keyframe 0");
  expect_refused_with(RowKey{Table::kRemoved, 0}, first + 8, 2.0, "no rotation");
  expect_refused_with(RowKey{Table::kRemoved, 0}, first + 40, -1e8, "a position is farther");
}

TEST_F(MapContent, FeaturesLieInTheImage) {
  const RowKey key{Table::kSeen, 0};
  const std::size_t n = map_.keyframe(KeyframeId{0}).data->features->size();
  const std::size_t depths = 4 + 16 * n;  // full floats in this keyframe, of unit 0
  const std::size_t levels = depths + 4 + 5 * n;
  expect_refused_with(key, 0, std::uint32_t{0xffffffff}, "seen 0: cut short, or a count too large");
  expect_refused_with(key, 0, static_cast<std::uint32_t>(n + 1), "seen 0: ");
  expect_refused_with(key, levels, std::uint8_t{100}, "keyframe 0: a feature of a pyramid level");
  expect_refused_with(key, depths, -1.0F, "seen 0: depths of no unit");
  expect_refused_with(key, depths, 0.001F, "seen 0: ");
  expect_refused_with(key, depths + 4 + 3 * n, std::uint8_t{0xbf}, "seen 0: a depth is negative");
  // The highest bytes of all numbers of a column stand together; of ideal_px its difference.
  expect_refused_with(key, 4 + 3 * n, std::uint8_t{0x7f}, "seen 0: a number is not finite");
  expect_refused_with(key, 4 + 8 * n + 3 * n, std::uint8_t{0x04},
                      "keyframe 0: a feature lies outside");
  const std::size_t free_space = levels + 33 * n;
  expect_refused_with(key, free_space, std::uint32_t{4000}, "seen 0: a free-space image is larger");
  expect_refused_with(key, free_space, std::uint32_t{0x80000000}, "seen 0: a free-space image");
  expect_refused_with(key, free_space + 8, -1.0F, "seen 0: depths of no unit");
  expect_refused_with(key, free_space + 8, 0.001F, "seen 0: ");
  const std::size_t read_out =
      free_space + 12 + 4 * map_.keyframe(KeyframeId{0}).data->free_space.blocks_m().size();
  expect_refused_with(key, read_out, 2.0, "seen 0: a shutter time is too long");
  expect_refused_with(key, read_out + 24, kNan, "seen 0: a number is not finite");
  expect_refused_with(key, read_out + 24, -1e7, "seen 0: a camera is too fast");
  expect_refused_with(RowKey{Table::kWeight, 0}, 0, static_cast<std::uint32_t>(0),
                      "weight 0: bytes left");
  expect_refused_with(RowKey{Table::kWeight, 0}, 4, std::uint8_t{3},
                      "weight 0: a weight of no kind");
  expect_refused_with(RowKey{Table::kWeight, 0}, 4, std::uint8_t{1}, "weight 0: ");
  expect_refused_with(RowKey{Table::kWeight, 0}, 4 + 4 * n, std::uint8_t{0xbf},
                      "weight 0: a weight is not in 0..1");
  restore();
  sign_row(path_, {Table::kWeight, 0}, [&](std::string& raw) {
    ArchiveWriter out;
    const std::vector<float> one_more(n + 1, 1.0F);
    map_fields::static_weight(out, one_more);
    raw = out.bytes();
  });
  expect_refused(path_, "weights of");
}

TEST_F(MapContent, LandmarksAreSeenByWhatIsThere) {
  using Landmarks = std::vector<Landmark>;
  using Sources = std::vector<std::uint8_t>;
  const auto change = [&](const std::function<void(Landmark&)>& first, const std::string& cause) {
    change_landmarks([&](Landmarks& all, Sources&) { first(all[1]); }, cause);
  };
  change([](Landmark& l) { l.observations.front().keyframe = KeyframeId{500}; }, "landmark 1: ");
  change([](Landmark& l) { l.observations.back().keyframe = KeyframeId{501}; },
         "seen by keyframe 501, which is not there");
  change([](Landmark& l) { l.observations.front().feature = 1'000'000; }, "has no feature 1000000");
  change([](Landmark& l) { l.observations.clear(); }, "landmark 1: nobody sees it");
  change([](Landmark& l) { l.observations.push_back(l.observations.back()); }, "not in order");
  change([](Landmark& l) { l.id = LandmarkId{0}; }, "landmark 0: comes twice");
  change([](Landmark& l) { l.id = kNoLandmark; }, "landmarks 0: a landmark of another chunk");
  change([](Landmark& l) { l.id = LandmarkId{1000}; }, "landmark 1000: the map has numbers below");
  change([](Landmark& l) { l.p_world.x() = kNan; }, "landmarks 0: a number is not finite");
  change([](Landmark& l) { l.p_world.y() = -1e200; }, "landmarks 0: a position is farther");
  change([](Landmark& l) { l.visible = l.found = std::numeric_limits<int>::max(); },
         "landmarks 0: a landmark was visible too often");
  change([](Landmark& l) { l.normal_world *= 2; }, "a normal has not length 1");
  change([](Landmark& l) { l.min_distance_m = 2 * l.max_distance_m; }, "no range of distances");
  change([](Landmark& l) { l.found = l.visible + 1; }, "found more often");
  change([](Landmark& l) { l.visible = -1; }, "found more often");
  change([](Landmark& l) { l.first_keyframe = kNoKeyframe; }, "first seen by keyframe");
  change([](Landmark& l) { l.max_distance_m = 2e30; }, "no range of distances");
  change_landmarks([](Landmarks& all, Sources&) { all.resize(all.size() - 1); }, "landmarks of");
  change_landmarks([](Landmarks& all, Sources&) { all[2].observations = all[1].observations; },
                   "shows another landmark");
  change_landmarks([](Landmarks&, Sources& sources) { sources[1] = 200; },
                   "landmark 1: its descriptor is of an observation that it has not");
}

TEST_F(MapContent, TheSummaryIsChecked) {
  const auto change = [&](const std::function<void(map_file::Meta&)>& how,
                          const std::string& cause) {
    restore();
    sign_meta(path_, how);
    expect_refused(path_, cause);
  };
  change([](auto& m) { m.info.camera.fx = -1; }, "camera.fx");
  change([](auto& m) { m.info.camera.width = 1 << 30; }, "image size");
  change([](auto& m) { m.info.camera.height = 0; }, "image size");
  change([](auto& m) { m.info.camera.k1 = -5; }, "camera.");
  change([](auto& m) { m.info.pyramid_levels = 1'000'000'000; }, "pyramid");
  change([](auto& m) { m.info.pyramid_factor = 1; }, "pyramid");
  change([](auto& m) { m.info.landmarks = 1; }, "landmarks of 1");
  change([](auto& m) { m.info.observations = 1; }, "observations of 1");
  change([](auto& m) { m.info.keyframes += 1; }, "keyframes of");
  change([](auto& m) { m.numbers.next_keyframe = 3; }, "the map has numbers below 3");
  change([](auto& m) { m.numbers.next_landmark = 3; }, "the map has numbers below 3");
  change([](auto& m) { m.numbers.next_landmark = index(kNoLandmark); }, "no numbers are left");
  change([](auto& m) { m.numbers.version = ~std::uint64_t{0}; }, "no numbers are left");
  change([](auto& m) { m.rows_digest ^= 1; }, "do not belong together");
}

}  // namespace
}  // namespace ygslam
