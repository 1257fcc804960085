#include "simulation/sequence/true_objects.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "simulation/sequence/test_worlds.hpp"

namespace ygslam::sim {
namespace {

nlohmann::json watched(const SequenceSource& source, double seconds) {
  TrueObjects objects;
  const GreyImage things(1, 1);
  const DepthImage depth_m(1, 1);
  for (double t_s = 0; t_s <= seconds; t_s += 0.1) {
    objects.add(source.scene(), t_s, {static_cast<std::int64_t>(t_s * 1e9)},
                {things, depth_m, source.camera(), source.T_world_camera(t_s)});
  }
  return nlohmann::json::parse(objects.json(source.scene()));
}

TEST(TrueObjects, EveryPixelOfAThingLiesInItsBox) {
  SequenceOptions options = small_options(0.3, 5);
  options.truth_things = true;
  SequenceSource source = open_or_die("moved_chair", options);
  const Scene& scene = source.scene();
  int checked = 0;
  while (const auto frame = source.next_with_losses()) {
    for (int v = 0; v < frame->things.height(); ++v) {
      for (int u = 0; u < frame->things.width(); ++u) {
        const std::uint8_t id = frame->things.at(u, v);
        if (id == 0) continue;
        const NamedThing& thing = scene.things.at(id - 1U);
        ASSERT_EQ(thing.id, id);
        const bool is_mover = thing.object > 0;
        ASSERT_EQ(is_mover && scene.movers[thing.object - 1].is_body(),
                  thing.class_name == "person");
        if (thing.class_name == "person" || thing.class_name == "wall") continue;
        const ThingBox box =
            box_of(is_mover ? scene.movers[thing.object - 1].mesh : scene.fixed, thing.part,
                   is_mover ? scene.movers[thing.object - 1].pose_at(frame->t_s) : SE3());
        const Vec3 p = frame->T_world_camera *
                       source.camera().unproject(Vec2(u, v), frame->depth_true_m.at(u, v));
        const Vec3 off = so3_exp(Vec3(0, 0, -box.yaw_rad)) * (p - box.centre);
        ASSERT_TRUE(((off.cwiseAbs() - box.size_m / 2).array() < 0.002).all())
            << thing.class_name << ' ' << off.transpose() << " of " << box.size_m.transpose();
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 2000);
}

TEST(TrueObjects, AThingThatWasPushedHasTwoPlacesAndTheFixedOnesHaveOne) {
  const auto truth = watched(open_or_die("moved_chair", small_options(20, 5)), 20);
  const auto& objects = truth.at("objects");
  int moved = 0, fixed = 0;
  for (const auto& object : objects) {
    const auto& places = object.at("places");
    ASSERT_NE(object.at("class"), "person");
    if (object.at("class") == "sports ball") {
      EXPECT_EQ(places.size(), 3U) << "it rolls twice; where it turns back at once is no place";
    } else if (places.size() == 1) {
      ++fixed;
      EXPECT_EQ(places[0].at("from_ns"), 0);
    } else {
      ++moved;
      EXPECT_EQ(object.at("class"), "chair");
      ASSERT_EQ(places.size(), 2U);
      EXPECT_LE(places[0].at("until_ns").get<double>(), 8e9);
      EXPECT_GE(places[1].at("from_ns").get<double>(), 10e9);
      const auto x_m = [&](int place) { return places[place].at("centre_m")[0].get<double>(); };
      EXPECT_GT(std::abs(x_m(1) - x_m(0)), 0.5);
    }
  }
  EXPECT_EQ(moved, 1);
  EXPECT_GT(fixed, 20);
}

TEST(TrueObjects, APlaceIsShownOnceEnoughOfItCanBeSeen) {
  SequenceSource source = open_or_die("moved_chair", small_options(24, 5));
  TrueObjects objects;
  while (const auto frame = source.next_with_losses())
    objects.add(source.scene(), frame->t_s, frame->frame->stamp,
                {frame->things, frame->depth_true_m, source.camera(), frame->T_world_camera});
  const auto truth = nlohmann::json::parse(objects.json(source.scene()));
  for (const auto& object : truth.at("objects")) {
    if (object.at("class") != "chair" || object.at("places").size() < 2) continue;
    const auto& old_place = object.at("places")[0];
    const auto& new_place = object.at("places")[1];
    const auto first_ns = [](const nlohmann::json& place, const char* spans) {
      return place.at(spans).at(0).at(0).get<std::int64_t>();
    };
    EXPECT_EQ(first_ns(old_place, "shown_ns"), old_place.at("from_ns"));
    EXPECT_GT(first_ns(old_place, "shown_empty_ns"), old_place.at("until_ns"));
    EXPECT_TRUE(new_place.at("shown_empty_ns").empty());
    double shown_s = 0;
    for (const auto& span : new_place.at("shown_ns")) {
      ASSERT_GE(span.at(0), new_place.at("from_ns"));
      ASSERT_LE(span.at(1), new_place.at("until_ns"));
      shown_s += 1e-9 * (span.at(1).get<double>() - span.at(0).get<double>());
    }
    // The man who pushed it stands before it, and it is out of the picture, for a while.
    EXPECT_GT(shown_s, 4);
    EXPECT_LT(shown_s, 9);
    return;
  }
  FAIL() << "no chair was moved";
}

TEST(TrueObjects, ADoorHasNoNameButPlaces) {
  const auto truth = watched(open_or_die("moved_chair", small_options(14, 5)), 14);
  ASSERT_EQ(truth.at("nameless").size(), 1U);
  const auto& door = truth.at("nameless")[0];
  EXPECT_EQ(door.at("class"), "door");
  const auto& places = door.at("places");
  ASSERT_EQ(places.size(), 2U) << "closed, and open to the end";
  EXPECT_LE(places[0].at("until_ns").get<double>(), 5.2e9);
  EXPECT_GE(places[1].at("from_ns").get<double>(), 6.7e9);
  EXPECT_GE(places[1].at("until_ns").get<double>(), 13.8e9);
  for (const auto& place : places) EXPECT_NEAR(place.at("size_m")[2].get<double>(), 0.9, 0.05);
}

TEST(TrueObjects, LeavingMoversOutChangesNoId) {
  SequenceOptions options = small_options(0.3, 5);
  const SequenceSource all = open_or_die("crowd", options);
  options.without_movers = true;
  const SequenceSource fixed = open_or_die("crowd", options);
  const auto& things = all.scene().things;
  ASSERT_GT(things.size(), fixed.scene().things.size());
  for (std::size_t i = 0; i < fixed.scene().things.size(); ++i) {
    EXPECT_EQ(things[i].id, fixed.scene().things[i].id);
    EXPECT_EQ(things[i].class_name, fixed.scene().things[i].class_name);
  }
  EXPECT_EQ(std::count_if(things.begin(), things.end(),
                          [](const NamedThing& thing) { return thing.class_name == "person"; }),
            5);
}

}  // namespace
}  // namespace ygslam::sim
