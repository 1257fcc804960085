#include "io/image_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <new>

#include "image/depth.hpp"
#include "io/png_codec.hpp"
#include "io/testing/small_sequence.hpp"

namespace ygslam {
namespace {

using testing::random_colour;
using testing::random_grey;

// Smooth enough for JPEG to keep it nearly.
ColourImage gradient(int width, int height) {
  ColourImage image(width, height);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      image.at(u, v) = {static_cast<std::uint8_t>(255 * u / width),
                        static_cast<std::uint8_t>(255 * v / height), 128};
    }
  }
  return image;
}

template <typename T>
bool equal(const Image<T>& a, const Image<T>& b) {
  return a.same_size(b) && std::equal(a.begin(), a.end(), b.begin());
}

std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = ~0U;
  for (const char c : bytes) {
    crc ^= static_cast<std::uint8_t>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

// A PNG that claims another size, with a correct check sum.
std::string with_claimed_size(std::string png, std::uint32_t width, std::uint32_t height) {
  const auto put = [&](std::size_t at, std::uint32_t value) {
    for (int i = 0; i < 4; ++i) png[at + i] = static_cast<char>(value >> (24 - 8 * i));
  };
  put(16, width);
  put(20, height);
  put(29, crc32(std::string_view(png).substr(12, 17)));
  return png;
}

TEST(Png, EveryKindComesBackUnchanged) {
  Rng rng(3);
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {64, 48}}) {
    const auto colour = random_colour(width, height, rng);
    const auto grey = random_grey<std::uint8_t>(width, height, rng);
    const auto depth = random_grey<std::uint16_t>(width, height, rng);
    EXPECT_TRUE(equal(*decode_colour(encode_png(colour)), colour));
    EXPECT_TRUE(equal(*decode_grey(encode_png(grey)), grey));
    EXPECT_TRUE(equal(*decode_depth(encode_png(depth)), depth));
    const auto as_colour = decode_colour(encode_png(grey), {}, 1);
    ASSERT_TRUE(as_colour.ok());
    EXPECT_EQ(as_colour->at(0, 0), (Rgb8{grey.at(0, 0), grey.at(0, 0), grey.at(0, 0)}));
  }
}

TEST(Png, EveryFilterAndLevelComesBackUnchanged) {
  Rng rng(7);
  const ColourImage smooth = gradient(64, 48);
  const ColourImage rough = random_colour(33, 48, rng);
  const auto depth = random_grey<std::uint16_t>(33, 48, rng);
  for (const PngFilter filter : {PngFilter::kBest, PngFilter::kNone, PngFilter::kUp}) {
    for (const int level : {0, 1, 6, 9}) {
      EXPECT_TRUE(equal(*decode_colour(encode_png(smooth, level, filter)), smooth)) << level;
      EXPECT_TRUE(equal(*decode_colour(encode_png(rough, level, filter)), rough)) << level;
      EXPECT_TRUE(equal(*decode_depth(encode_png(depth, level, filter)), depth)) << level;
    }
  }
  EXPECT_LT(encode_png(smooth, 6, PngFilter::kBest).size(),
            encode_png(smooth, 6, PngFilter::kNone).size());
}

TEST(Jpeg, ComesBackNearlyUnchangedWithChannelsInOrder) {
  const ColourImage image = gradient(64, 48);
  const auto back = decode_colour(encode_jpeg(image, 95), ImageSize{64, 48});
  ASSERT_TRUE(back.ok());
  for (std::size_t i = 0; i < image.size(); ++i) {
    EXPECT_NEAR(back->data()[i].r, image.data()[i].r, 12);
    EXPECT_NEAR(back->data()[i].g, image.data()[i].g, 12);
    EXPECT_NEAR(back->data()[i].b, image.data()[i].b, 12);
  }
}

TEST(Jpeg, F2TruncatedAnywhereIsBadNeverAGreyImage) {
  Rng rng(4);
  const std::string bytes = encode_jpeg(random_colour(64, 48, rng));
  for (std::size_t length = 0; length < bytes.size(); length += 1 + bytes.size() / 200) {
    const auto image = decode_colour(std::string_view(bytes).substr(0, length));
    ASSERT_FALSE(image.ok()) << length << " of " << bytes.size();
    EXPECT_FALSE(image.error().message.empty());
  }
  // The last byte alone, and a tail cut out of the middle with the end marker kept.
  EXPECT_FALSE(decode_colour(std::string_view(bytes).substr(0, bytes.size() - 1)).ok());
  EXPECT_FALSE(decode_colour(bytes.substr(0, bytes.size() / 2) + "\xFF\xD9").ok());
}

TEST(Jpeg, PaddingBehindTheEndIsNoDamage) {
  EXPECT_TRUE(decode_colour(encode_jpeg(gradient(32, 24)) + std::string(16, '\0')).ok());
}

TEST(Png, F2TruncatedAnywhereIsBad) {
  Rng rng(5);
  const std::string depth = encode_png(random_grey<std::uint16_t>(32, 24, rng));
  const std::string colour = encode_png(random_colour(32, 24, rng));
  for (std::size_t length = 0; length < depth.size(); ++length) {
    ASSERT_FALSE(decode_depth(std::string_view(depth).substr(0, length)).ok()) << length;
  }
  for (std::size_t length = 0; length < colour.size(); length += 3) {
    ASSERT_FALSE(decode_colour(std::string_view(colour).substr(0, length)).ok()) << length;
  }
}

TEST(Png, F2FlippedByteIsFoundByTheCheckSums) {
  Rng rng(6);
  const std::string good = encode_png(random_grey<std::uint16_t>(32, 24, rng));
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ (1 << rng.below(8)));
    const auto image = decode_depth(bad);
    EXPECT_FALSE(image.ok()) << "byte " << i;
  }
}

TEST(Images, F3OtherSizeChannelsOrBitDepthIsRefusedWithTheReason) {
  Rng rng(8);
  const ImageSize expected = {32, 24};
  const auto reason = [](const auto& result) {
    return result.ok() ? std::string() : result.error().message;
  };
  const std::string colour = encode_png(random_colour(32, 24, rng));
  const std::string grey = encode_png(random_grey<std::uint8_t>(32, 24, rng));
  const std::string depth = encode_png(random_grey<std::uint16_t>(32, 24, rng));
  const std::string small = encode_png(random_colour(16, 12, rng));
  EXPECT_NE(reason(decode_colour(small, expected)).find("16x12, expected 32x24"),
            std::string::npos);
  EXPECT_NE(reason(decode_colour(grey, expected)).find("1 channel(s) of 8 bit, expected 3"),
            std::string::npos);
  EXPECT_NE(reason(decode_colour(depth, expected)).find("16 bit"), std::string::npos);
  const std::vector<std::uint8_t> bits(std::size_t{32} * 24, 0x5A);
  const std::string mask = png::encode(bits.data(), {expected, 1, 1, false}, 1, PngFilter::kNone);
  EXPECT_NE(reason(decode_colour(mask, expected, 1)).find("1 bit, expected 1 channel(s) of 8"),
            std::string::npos);
  EXPECT_NE(reason(decode_depth(grey, expected)).find("8 bit"), std::string::npos);
  EXPECT_FALSE(decode_depth(colour, expected).ok());
  EXPECT_FALSE(decode_depth(encode_jpeg(gradient(32, 24)), expected).ok());
  EXPECT_FALSE(decode_colour("", expected).ok());
  EXPECT_FALSE(decode_colour("GIF89a and so on", expected).ok());
  using namespace std::string_view_literals;
  for (const auto& [bytes, words] :
       {std::pair{"version https://git-lfs.github.com/spec/v1\n"sv, "is a pointer of Git LFS"},
        {"<!DOCTYPE html>"sv, "is a text in HTML or XML"},
        {"\x1F\x8B\x08"sv, "is a file compressed with gzip"},
        {"P3\n2 2\n255\n"sv, "is a PPM as text"},
        {"\0\0\0\x20"
         "ftypheic"sv,
         "is HEIF, AVIF or MP4"}}) {
    const auto refused = decode_colour(std::string(bytes), expected);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().message.find(words), 0U) << refused.error().message;
  }
}

TEST(Images, AnAbsurdSizeIsRefusedBeforeAnythingIsAllocated) {
  Rng rng(9);
  const std::string png = encode_png(random_grey<std::uint16_t>(8, 8, rng));
  EXPECT_TRUE(decode_depth(with_claimed_size(png, 8, 8)).ok());
  for (const auto& [width, height] :
       {std::pair{0x7fffffffU, 0x7fffffffU}, {16385U, 8U}, {16384U, 16384U}, {0U, 8U}}) {
    EXPECT_FALSE(decode_depth(with_claimed_size(png, width, height)).ok()) << width;
  }
}

TEST(Grey, IsRec601Luma) {
  for (int value = 0; value < 256; ++value) {
    const auto level = static_cast<std::uint8_t>(value);
    EXPECT_EQ(grey_from_colour(ColourImage(1, 1, Rgb8{level, level, level})).at(0, 0), level);
  }
  Rng rng(10);
  const ColourImage colour = random_colour(50, 50, rng);
  const GreyImage grey = grey_from_colour(colour);
  for (std::size_t i = 0; i < colour.size(); ++i) {
    const Rgb8 c = colour.data()[i];
    EXPECT_NEAR(grey.data()[i], 0.299 * c.r + 0.587 * c.g + 0.114 * c.b, 0.52);
  }
}

TEST(Depth, F5NanInfiniteNegativeAndFarFloatValuesBecomeNone) {
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  DepthImage depth_m(8, 1, 1.5F);
  const std::array<float, 7> bad = {nan, -nan, inf, -inf, -1.0F, 1e30F, 0.01F};
  std::copy(bad.begin(), bad.end(), depth_m.begin());
  const DepthImage clean = sanitized_depth(depth_m, DepthConfig{});
  for (std::size_t i = 0; i < bad.size(); ++i) EXPECT_EQ(clean.data()[i], 0.0F) << bad[i];
  EXPECT_EQ(clean.data()[7], 1.5F);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// In a child each: nothing is left but `bytes`. @return 0 what was asked for, 1 std::bad_alloc,
// 2 anything else.
template <typename Work>
int outcome_within(std::size_t bytes, const Work& work) {
  std::vector<void*> room(bytes / 4096 + 1);
  for (void*& piece : room) piece = std::malloc(4000);
  room.back() = std::realloc(room.back(), bytes % 4096 + 1);
  const rlimit nothing_more{0, 0};
  setrlimit(RLIMIT_DATA, &nothing_more);
  // Small pieces that were used before are kept by their size.
  for (std::size_t piece = 1 << 20; piece >= 16; piece = piece > 2048 ? piece / 2 : piece - 16) {
    while (volatile void* taken = std::malloc(piece)) static_cast<void>(taken);
  }
  for (void* piece : room) std::free(piece);
  try {
    return work() ? 0 : 2;
  } catch (const std::bad_alloc&) {
    return 1;
  }
}

TEST(ImageFile, WantOfMemoryIsNoFaultOfTheFile) {
  const ColourImage colour = gradient(64, 48);
  const std::string png = encode_png(colour);
  const std::string jpeg = encode_jpeg(colour);
  const auto tries = {
      std::function([&] { return decode_colour(png).ok(); }),
      std::function([&] { return decode_colour(jpeg).ok(); }),
      std::function([&] { return encode_png(colour) == png; }),
      std::function([&] { return encode_jpeg(colour) == jpeg; }),
  };
  for (const auto& work : tries) {
    int outcomes[2] = {};
    // In small steps at first: a library's structures are small, and each can be the one too much.
    for (std::size_t bytes = 0; bytes <= 1 << 20; bytes += bytes < 4096 ? 64 : 1 << 14) {
      EXPECT_EXIT(
          std::_Exit(outcome_within(bytes, work)),
          [&](int status) {
            if (!WIFEXITED(status) || WEXITSTATUS(status) > 1) return false;
            ++outcomes[WEXITSTATUS(status)];
            return true;
          },
          "")
          << bytes << " bytes";
    }
    EXPECT_GT(outcomes[0], 0);
    EXPECT_GT(outcomes[1], 0);
  }
}
#endif

}  // namespace
}  // namespace ygslam
