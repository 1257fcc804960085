// The fast way to a PNG's pixels beside libpng's, which decides wherever the former gives up.
#include "io/plain_png.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <string>
#include <vector>

#include "core/rng.hpp"
#include "io/png_codec.hpp"

namespace ygslam::png {
namespace {

std::string big_endian(std::uint32_t number) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift & 255U);
  return bytes;
}

std::string chunk(const std::string& type, const std::string& content) {
  const std::string named = type + content;
  const auto sum =
      ::crc32(0, reinterpret_cast<const Bytef*>(named.data()), static_cast<uInt>(named.size()));
  return big_endian(static_cast<std::uint32_t>(content.size())) + named +
         big_endian(static_cast<std::uint32_t>(sum));
}

enum class Window { k32kB, k16kB };  // the latter is libpng's alone

std::string compressed(const std::string& bytes, Window window) {
  std::string out(compressBound(static_cast<uLong>(bytes.size())), '\0');
  auto length = static_cast<uLongf>(out.size());
  compress(reinterpret_cast<Bytef*>(out.data()), &length,
           reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size()));
  return (window == Window::k32kB ? "\x78\x01" : "\x68\x05") + out.substr(2, length - 2);
}

struct Kind {
  int colour_type, channels, bits;
};
constexpr Kind kKinds[] = {{0, 1, 8}, {0, 1, 16}, {2, 3, 8}, {4, 2, 8}, {6, 4, 8}, {4, 2, 16}};
constexpr int kWidth = 31, kHeight = 40;

/// Any bytes are a picture, behind a filter's number in each row.
std::string random_rows(const Kind& kind, Rng& rng) {
  std::string rows;
  for (int v = 0; v < kHeight; ++v) {
    rows += static_cast<char>(v % 5);
    for (int i = 0; i < kWidth * kind.channels * kind.bits / 8; ++i)
      rows += static_cast<char>(rng.below(3) == 0 ? rng.below(256) : 0);
  }
  return rows;
}

std::string file_of(const Kind& kind, const std::string& chunks) {
  const std::string header = big_endian(kWidth) + big_endian(kHeight) +
                             static_cast<char>(kind.bits) + static_cast<char>(kind.colour_type) +
                             std::string(3, '\0');
  return "\x89PNG\r\n\x1A\n" + chunk("IHDR", header) + chunks + chunk("IEND", "");
}
std::string file_of(const Kind& kind, const std::string& rows, Window window) {
  return file_of(kind, chunk("IDAT", compressed(rows, window)));
}

using Pixels = std::vector<std::uint8_t>;
Pixels room_for(const Kind& kind) {
  return Pixels(static_cast<std::size_t>(kWidth * kHeight * kind.channels * kind.bits / 8));
}
/// What libpng, or both, say.
Result<Pixels> decoded(const std::string& file, const Kind& kind) {
  Pixels pixels = room_for(kind);
  const Status done = decode(file, pixels.data());
  if (!done.ok()) return done.error();
  return pixels;
}
bool is_plain(const std::string& file, const Kind& kind) {
  const auto known = header(file);
  Pixels pixels = room_for(kind);
  return known.ok() && decode_plain(file, *known, pixels.data());
}

TEST(PlainPng, EveryFilterGivesThePixelsOfLibpng) {
  Rng rng(8);
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(::testing::Message() << kind.channels << " of " << kind.bits);
    const std::string rows = random_rows(kind, rng);
    const std::string plain = file_of(kind, rows, Window::k32kB);
    const std::string other = file_of(kind, rows, Window::k16kB);
    EXPECT_TRUE(is_plain(plain, kind));
    EXPECT_FALSE(is_plain(other, kind));
    const auto expected = decoded(other, kind);
    ASSERT_TRUE(expected.ok()) << expected.error().message;
    EXPECT_EQ(*decoded(plain, kind), *expected);
  }
}

// Rows are read in words of four bytes: narrower ones would be read beyond.
TEST(PlainPng, NarrowImagesAreLibpngs) {
  const auto bytes = [](int width) {
    std::string rows;
    for (int v = 0; v < kHeight; ++v)
      rows += static_cast<char>(v % 5) + std::string(static_cast<std::size_t>(width), '\x07');
    const std::string header = big_endian(static_cast<std::uint32_t>(width)) + big_endian(kHeight) +
                               "\x08" + std::string(4, '\0');
    return "\x89PNG\r\n\x1A\n" + chunk("IHDR", header) +
           chunk("IDAT", compressed(rows, Window::k32kB)) + chunk("IEND", "");
  };
  for (int width = 1; width <= 5; ++width) {
    const std::string file = bytes(width);
    const auto known = header(file);
    ASSERT_TRUE(known.ok());
    Pixels pixels(static_cast<std::size_t>(width * kHeight));
    EXPECT_EQ(decode_plain(file, *known, pixels.data()), width >= 4) << width;
    EXPECT_TRUE(decode(file, pixels.data()).ok()) << width;
  }
}

TEST(PlainPng, TextsAndManyPiecesAreNoObstacle) {
  Rng rng(9);
  const Kind& kind = kKinds[2];
  const std::string rows = random_rows(kind, rng);
  const std::string whole = compressed(rows, Window::k32kB);
  const std::string text = chunk("tEXt", "when and where");
  std::string pieces;
  for (std::size_t at = 0; at < whole.size(); at += 100)
    pieces += chunk("IDAT", whole.substr(at, 100));
  const std::string file = file_of(kind, text + pieces + text);
  EXPECT_TRUE(is_plain(file, kind));
  EXPECT_EQ(*decoded(file, kind), *decoded(file_of(kind, rows, Window::k16kB), kind));
  EXPECT_FALSE(decoded(file_of(kind, chunk("IDAT", whole.substr(0, 100)) + text +
                                         chunk("IDAT", whole.substr(100))),
                       kind)
                   .ok());
}

TEST(PlainPng, WhatIsDamagedIsToldInLibpngsWords) {
  Rng rng(10);
  const Kind& kind = kKinds[1];
  std::string rows = random_rows(kind, rng);
  const auto same_fault = [&](const std::string& content) {
    const auto plain = decoded(file_of(kind, content, Window::k32kB), kind);
    const auto other = decoded(file_of(kind, content, Window::k16kB), kind);
    ASSERT_FALSE(plain.ok());
    ASSERT_FALSE(other.ok());
    EXPECT_EQ(plain.error().message, other.error().message);
  };
  same_fault(rows + "x");
  same_fault(rows.substr(0, rows.size() - 1));
  rows[0] = 5;
  same_fault(rows);
  const std::string trailer = compressed(random_rows(kind, rng), Window::k32kB) + "x";
  EXPECT_FALSE(decoded(file_of(kind, chunk("IDAT", trailer)), kind).ok());
  EXPECT_FALSE(decoded(file_of(kind, ""), kind).ok());
}

TEST(PlainPng, AnyShorterFileAndAnyOtherByteIsFound) {
  Rng rng(11);
  const Kind& kind = kKinds[1];
  const std::string good = file_of(kind, random_rows(kind, rng), Window::k32kB);
  ASSERT_TRUE(is_plain(good, kind));
  for (std::size_t i = 0; i < good.size(); ++i) {
    EXPECT_FALSE(is_plain(good.substr(0, i), kind)) << i;
    EXPECT_FALSE(decoded(good.substr(0, i), kind).ok()) << i;
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ (1 << rng.below(8)));
    EXPECT_FALSE(is_plain(bad, kind)) << i;
    EXPECT_FALSE(decoded(bad, kind).ok()) << i;
  }
}

}  // namespace
}  // namespace ygslam::png
