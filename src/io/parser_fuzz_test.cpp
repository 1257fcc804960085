// F25: every parser of foreign files survives thousands of damaged inputs. The mutants are the same
// in every run; sanitizer builds make a stricter test of it.
#include <gtest/gtest.h>

#include <functional>

#include "io/calibration.hpp"
#include "io/image_file.hpp"
#include "io/image_list.hpp"
#include "io/json_text.hpp"
#include "io/testing/small_sequence.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {
namespace {

constexpr int kMutants = 2000;

// One to eight random changes: bytes flipped, cut out, doubled, or words that parsers stumble over.
std::string mutant_of(std::string bytes, Rng& rng) {
  static constexpr std::array<std::string_view, 12> kNasty = {
      "nan",  "-inf", "1e999", "99999999999999999999", "-1", "\n", " ", "..", "/",
      "[[[[", "#",    "\0"};
  const auto place = [&] { return rng.below(static_cast<std::uint32_t>(bytes.size()) + 1); };
  for (std::uint32_t n = 1 + rng.below(8); n > 0; --n) {
    const std::size_t at = place();
    const std::size_t length = std::min<std::size_t>(rng.below(32), bytes.size() - at);
    switch (rng.below(5)) {
      case 0:
        if (at < bytes.size()) bytes[at] = static_cast<char>(rng.next());
        break;
      case 1:
        bytes.erase(at, length);
        break;
      case 2:
        bytes.insert(at, bytes.substr(at, length));
        break;
      case 3:
        bytes.insert(at, kNasty[rng.below(kNasty.size())]);
        break;
      default:
        if (rng.below(8) == 0) bytes.resize(at);
        break;
    }
  }
  return bytes;
}

// Runs the parser on mutants; it says whether it took the input, and checks what it took.
void expect_survives(const std::string& seed,
                     const std::function<bool(const std::string&)>& parse) {
  ASSERT_TRUE(parse(seed)) << "the undamaged input must be taken";
  Rng rng(17);
  int refused = 0;
  for (int i = 0; i < kMutants; ++i) refused += parse(mutant_of(seed, rng)) ? 0 : 1;
  EXPECT_GT(refused, 0) << "no mutant was bad enough: the test tests nothing";
}

TEST(ParserFuzz, F25ImageLists) {
  std::string list;
  std::string pairs;
  for (int i = 0; i < 20; ++i) {
    const std::string stamp = "1305031242." + std::to_string(100000 + i * 33333);
    list += stamp + " rgb/" + stamp + ".png\n";
    pairs += stamp + " rgb/" + stamp + ".png " + stamp + " depth/" + stamp + ".png\n";
  }
  expect_survives(list, [](const std::string& text) {
    const auto parsed = parse_image_list(text);
    for (const ListedImage& image : parsed.entries) EXPECT_TRUE(is_inside(image.file));
    return parsed.counts.left_out() == 0;
  });
  expect_survives(pairs, [](const std::string& text) {
    const auto parsed = parse_associations(text);
    for (const ListedPair& pair : parsed.entries) EXPECT_TRUE(is_inside(pair.depth.file));
    return parsed.counts.left_out() == 0;
  });
}

TEST(ParserFuzz, F25Calibration) {
  expect_survives(
      "fx 517.3\nfy 516.5\ncx 318.6\ncy 255.3\nk1 0.26\nk2 -0.95\nk3 1.16\nwidth 640\nheight 480\n",
      [](const std::string& text) {
        const auto camera = parse_calibration(text, "c");
        if (camera.ok()) {
          EXPECT_TRUE(camera_faults(*camera).empty());
        }
        return camera.ok();
      });
}

TEST(ParserFuzz, F25Trajectory) {
  std::string seed = "# stamp tx ty tz qx qy qz qw\n";
  for (int i = 0; i < 10; ++i) {
    seed += format_tum(StampedPose{{i * 100'000'000}, SE3(Mat3::Identity(), {0.1 * i, 1, 2})}, 6);
  }
  expect_survives(seed, [](const std::string& text) {
    const auto poses = parse_tum_trajectory(text, "t");
    if (!poses.ok()) return false;
    for (const StampedPose& pose : *poses) EXPECT_TRUE(pose.T_world_camera.is_finite());
    return true;
  });
}

TEST(ParserFuzz, F25Json) {
  expect_survives(R"({"classes": {"1": "person", "2": ["a", 1.5e3, null, true]}, "x": "\u00e4"})",
                  [](const std::string& text) {
                    const auto json = parse_json(text, "j");
                    if (json.ok())
                      (void)json->dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
                    return json.ok();
                  });
}

TEST(ParserFuzz, F25Png) {
  Rng rng(3);
  const auto depth = testing::random_grey<std::uint16_t>(16, 12, rng);
  expect_survives(encode_png(depth), [](const std::string& bytes) {
    (void)decode_header(bytes).ok();
    (void)decode_colour(bytes).ok();
    return decode_depth(bytes).ok();
  });
  expect_survives(encode_png(testing::random_colour(16, 12, rng)),
                  [](const std::string& bytes) { return decode_colour(bytes).ok(); });
}

TEST(ParserFuzz, F25Jpeg) {
  Rng rng(4);
  expect_survives(encode_jpeg(testing::random_colour(32, 24, rng)), [](const std::string& bytes) {
    const auto image = decode_colour(bytes);
    if (image.ok()) {
      EXPECT_LE(image->size(), static_cast<std::size_t>(kMaxImagePixels));
    }
    return image.ok();
  });
}

}  // namespace
}  // namespace ygslam
