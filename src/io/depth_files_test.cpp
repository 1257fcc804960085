// Depth and colour in files other than JPEG and 16-bit PNG, as other libraries write them.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include <algorithm>
#include <vector>

#include "io/image_file.hpp"
#include "io/testing/small_sequence.hpp"

namespace ygslam {
namespace {

using testing::TempFolder;

constexpr int kWidth = 9, kHeight = 5;
constexpr double kScale = 1000;

/// 1.000 m, 1.001 m, ...
DepthImage slope_m() {
  DepthImage depth_m(kWidth, kHeight);
  for (std::size_t i = 0; i < depth_m.size(); ++i)
    depth_m.data()[i] = 1.0F + 0.001F * static_cast<float>(i);
  return depth_m;
}

template <typename T>
std::string bytes_of(const Image<T>& image) {
  return {reinterpret_cast<const char*>(image.data()), image.size() * sizeof(T)};
}
template <typename T>
std::string swapped(std::string bytes) {
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(T))
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                 bytes.begin() + static_cast<std::ptrdiff_t>(i + sizeof(T)));
  return bytes;
}

/// Of the same depth in units.
Image<std::uint16_t> slope_units() { return raw_from_depth(slope_m(), kScale); }

template <typename T>
std::string tiff_of(const Image<T>& image, int compression, int channels = 1,
                    const char* mode = "w") {
  const TempFolder folder;
  const std::string path = (folder.path() / "a.tiff").string();
  TIFF* tiff = TIFFOpen(path.c_str(), mode);
  const int bits = 8 * static_cast<int>(sizeof(T)) / channels;
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, image.width());
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, image.height());
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, channels);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, bits >= 32 ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, compression);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 2);
  Image<T> rows = image;  // the library turns bytes in place
  for (int v = 0; v < image.height(); ++v)
    TIFFWriteScanline(tiff, rows.row(v), static_cast<std::uint32_t>(v), 0);
  TIFFClose(tiff);
  return testing::read(path);
}

std::string exr_of(const DepthImage& image, Imf::Compression compression,
                   const std::vector<std::string>& channels = {"Y"}) {
  const TempFolder folder;
  const std::string path = (folder.path() / "a.exr").string();
  {
    Imf::Header header(image.width(), image.height());
    header.compression() = compression;
    Imf::FrameBuffer rows;
    for (const std::string& name : channels) {
      header.channels().insert(name, Imf::Channel(Imf::FLOAT));
      rows.insert(name, Imf::Slice(Imf::FLOAT,
                                   const_cast<char*>(reinterpret_cast<const char*>(image.data())),
                                   sizeof(float), sizeof(float) * image.width()));
    }
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(rows);
    file.writePixels(image.height());
  }
  return testing::read(path);
}

std::string npy_of(const std::string& type, const std::string& data,
                   const std::string& shape = "(5, 9)", const std::string& order = "False") {
  std::string head =
      "{'descr': '" + type + "', 'fortran_order': " + order + ", 'shape': " + shape + ", }";
  head.resize(117, ' ');
  head += '\n';
  std::string file = "\x93NUMPY";
  file += {1, 0, static_cast<char>(head.size()), 0};
  return file + head + data;
}

void expect_slope(const std::string& bytes, const std::string& kind, float tolerance_m = 1e-6F) {
  const auto depth_m = decode_depth_m(bytes, ImageSize{kWidth, kHeight}, kScale, {});
  ASSERT_TRUE(depth_m.ok()) << kind << ": " << depth_m.error().message;
  const DepthImage wanted = slope_m();
  for (std::size_t i = 0; i < wanted.size(); ++i)
    ASSERT_NEAR(depth_m->data()[i], wanted.data()[i], tolerance_m) << kind << " " << i;
  EXPECT_EQ(shown_kind(*decode_header(bytes)), kind);
}

std::string reason(const std::string& bytes) {
  const auto depth_m = decode_depth_m(bytes, ImageSize{kWidth, kHeight}, kScale, {});
  return depth_m.ok() ? "accepted" : depth_m.error().message;
}

TEST(DepthFiles, TiffOfUnitsAndOfMetres) {
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE})
    for (const char* mode : {"wl", "wb", "w8"}) {
      expect_slope(tiff_of(slope_units(), compression, 1, mode), "16-bit TIFF");
      expect_slope(tiff_of(slope_m(), compression, 1, mode), "float TIFF");
    }
  Image<double> doubles(kWidth, kHeight);
  for (std::size_t i = 0; i < doubles.size(); ++i)
    doubles.data()[i] = 1.0 + 0.001 * static_cast<double>(i);
  expect_slope(tiff_of(doubles, COMPRESSION_NONE), "float TIFF");
}

TEST(DepthFiles, ExrOfMetres) {
  for (const auto compression : {Imf::NO_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION})
    expect_slope(exr_of(slope_m(), compression), "float EXR");
  expect_slope(exr_of(slope_m(), Imf::ZIPS_COMPRESSION, {"depth.Z"}), "float EXR");
  expect_slope(exr_of(slope_m(), Imf::ZIPS_COMPRESSION, {"A", "Z"}), "float EXR");
  EXPECT_NE(reason(exr_of(slope_m(), Imf::ZIPS_COMPRESSION, {"B", "G", "R"}))
                .find("which of the channels of this EXR file is depth? B, G, R"),
            std::string::npos);
}

TEST(DepthFiles, NumpyOfUnitsAndOfMetres) {
  const std::string floats = bytes_of(slope_m());
  expect_slope(npy_of("<f4", floats), "float NumPy");
  expect_slope(npy_of(">f4", swapped<float>(floats)), "float NumPy");
  expect_slope(npy_of("<f4", floats, "(5, 9, 1)"), "float NumPy");
  expect_slope(npy_of("<f4", floats, "(1, 5, 9)"), "float NumPy");
  const std::string units = bytes_of(slope_units());
  expect_slope(npy_of("<u2", units), "16-bit NumPy");
  expect_slope(npy_of(">u2", swapped<std::uint16_t>(units)), "16-bit NumPy");
  Image<double> doubles(kWidth, kHeight);
  Image<Eigen::half> halves(kWidth, kHeight);
  for (std::size_t i = 0; i < doubles.size(); ++i) {
    doubles.data()[i] = 1.0 + 0.001 * static_cast<double>(i);
    halves.data()[i] = static_cast<Eigen::half>(doubles.data()[i]);
  }
  expect_slope(npy_of("<f8", bytes_of(doubles)), "float NumPy");
  expect_slope(npy_of("<f2", bytes_of(halves)), "float NumPy", 5e-4F);
  EXPECT_NE(reason(npy_of("<i8", bytes_of(doubles))).find("of type '<i8'"), std::string::npos);
  EXPECT_NE(reason(npy_of("<f4", floats, "(5, 9)", "True")).find("columns first"),
            std::string::npos);
  EXPECT_NE(reason(npy_of("<f4", floats, "(45,)")).find("shape (45,) is no image of H x W"),
            std::string::npos);
  EXPECT_NE(reason(npy_of("<f4", floats + "x")).find("more bytes"), std::string::npos);
}

TEST(DepthFiles, PgmOfUnitsAndPfmOfMetres) {
  const std::string units = swapped<std::uint16_t>(bytes_of(slope_units()));
  expect_slope("P5\n# a comment\n9 5\n65535\n" + units, "16-bit PGM");
  DepthImage turned(kWidth, kHeight);  // PFM begins with the lowest row
  for (int v = 0; v < kHeight; ++v)
    std::copy_n(slope_m().row(kHeight - 1 - v), kWidth, turned.row(v));
  expect_slope("Pf\n9 5\n-1.0\n" + bytes_of(turned), "float PFM");
  expect_slope("Pf\n9 5\n1.0\n" + swapped<float>(bytes_of(turned)), "float PFM");
  EXPECT_NE(reason("P5\n9 5\n255\n" + std::string(45, 'x')).find("1 channel(s) of 8 bit"),
            std::string::npos)
      << "a picture of depth is none";
}

TEST(DepthFiles, SwappedBytesAreRefused) {
  Image<std::uint16_t> slope(64, 48);
  for (std::size_t i = 0; i < slope.size(); ++i)
    slope.data()[i] = static_cast<std::uint16_t>(5000 + 7 * (i % 64) + 3 * (i / 64));
  Image<std::uint16_t> wrong = slope;
  for (std::uint16_t& value : wrong) value = static_cast<std::uint16_t>(value << 8U | value >> 8U);
  const std::string head = "P5\n64 48\n65535\n";
  const auto reason_of = [](const std::string& bytes) {
    const auto depth = decode_depth_m(bytes, ImageSize{64, 48}, 5000, {});
    return depth.ok() ? std::string() : depth.error().message;
  };
  EXPECT_EQ(reason_of(head + swapped<std::uint16_t>(bytes_of(slope))), "");
  EXPECT_NE(reason_of(head + bytes_of(slope)).find("a PGM has the high byte first"),
            std::string::npos);
  EXPECT_EQ(reason_of(encode_png(slope)), "");
  EXPECT_NE(reason_of(encode_png(wrong)).find("bytes swapped"), std::string::npos);
  for (std::uint16_t& value : slope) value -= value % 19U;  // in steps, as a Kinect's
  for (std::size_t i = 0; i < slope.size(); ++i)
    wrong.data()[i] = static_cast<std::uint16_t>(slope.data()[i] << 8U | slope.data()[i] >> 8U);
  EXPECT_EQ(reason_of(encode_png(slope)), "");
  EXPECT_NE(reason_of(encode_png(wrong)).find("bytes swapped"), std::string::npos);
  for (std::uint16_t& value : slope) value &= 0xFF00U;  // depth of 8 bits, in the upper ones
  EXPECT_EQ(reason_of(encode_png(slope)), "");
  for (std::size_t i = 0; i < slope.size(); ++i)  // noise tells nothing
    slope.data()[i] = static_cast<std::uint16_t>(i * 40503U);
  EXPECT_EQ(reason_of(encode_png(slope)), "");
}

TEST(DepthFiles, AnyShorterFileIsRefused) {
  const std::vector<std::string> files = {
      tiff_of(slope_units(), COMPRESSION_NONE),     tiff_of(slope_m(), COMPRESSION_ADOBE_DEFLATE),
      exr_of(slope_m(), Imf::ZIP_COMPRESSION),      npy_of("<f4", bytes_of(slope_m())),
      "P5\n9 5\n65535\n" + bytes_of(slope_units()), "Pf\n9 5\n-1\n" + bytes_of(slope_m())};
  for (const std::string& file : files)
    for (std::size_t size = 0; size < file.size(); ++size)
      EXPECT_NE(reason(file.substr(0, size)), "accepted") << size << " of " << file.size();
}

TEST(DepthFiles, OtherSizesAndAbsurdOnesAreRefused) {
  for (const std::string& file :
       {tiff_of(slope_m(), COMPRESSION_NONE), exr_of(slope_m(), Imf::ZIP_COMPRESSION),
        npy_of("<f4", bytes_of(slope_m())), "Pf\n9 5\n-1\n" + bytes_of(slope_m())}) {
    const auto other = decode_depth_m(file, ImageSize{5, 9}, kScale, {});
    ASSERT_FALSE(other.ok());
    EXPECT_EQ(other.error().message, "other size: 9x5, expected 5x9");
  }
  std::string exr = exr_of(slope_m(), Imf::ZIP_COMPRESSION);
  for (const std::string name : {"dataWindow", "displayWindow"}) {
    const std::size_t box = exr.find(name) + name.size() + sizeof "" + sizeof "box2i" + 4;
    exr.replace(box + 12, 4, "\xf0\xff\xff\x7f");  // the last row
  }
  EXPECT_NE(reason(exr).find("EXR"), std::string::npos);
  EXPECT_NE(reason("P5\n99999999 5\n65535\nx").find("absurd size"), std::string::npos);
  EXPECT_NE(reason(npy_of("<f4", "x", "(99999999, 9)")).find("absurd size"), std::string::npos);
}

TEST(DepthFiles, MillimetresAsFloatsAreNotTakenForMetres) {
  DepthImage in_mm = slope_m();
  for (float& d : in_mm) d *= 1000;
  EXPECT_EQ(reason(npy_of("<f4", bytes_of(in_mm))),
            "float depth of about 1022: metres are expected; are these millimetres?");
  EXPECT_EQ(reason(npy_of("<f4", bytes_of(DepthImage(kWidth, kHeight, 0.0F)))), "accepted")
      << "none at all is an image without depth";
  EXPECT_EQ(reason(npy_of("<f4", bytes_of(DepthImage(kWidth, kHeight, 65.535F)))), "accepted");
}

TEST(DepthFiles, WhatIsNotReadIsNamed) {
  EXPECT_NE(reason("BM and so on").find("is a BMP; read are"), std::string::npos);
  EXPECT_NE(reason("P2\n9 5\n255\n1 2 3").find("PGM as text"), std::string::npos);
  EXPECT_NE(reason(encode_jpeg(ColourImage(kWidth, kHeight))).find("or one of floats"),
            std::string::npos);
}

TEST(ColourFiles, AlphaIsLeftOutAndPalettesAreColours) {
  Rng rng(5);
  const ColourImage colour = testing::random_colour(8, 6, rng);
  const auto expect_colour = [&](const std::string& bytes, const std::string& kind) {
    const auto back = decode_colour(bytes, ImageSize{8, 6});
    ASSERT_TRUE(back.ok()) << kind << ": " << back.error().message;
    EXPECT_TRUE(std::equal(colour.begin(), colour.end(), back->begin())) << kind;
    EXPECT_EQ(shown_kind(*decode_header(bytes)), kind);
  };
  expect_colour("P6\n8 6\n255\n" + bytes_of(colour), "8-bit PPM with 3 channels");
  expect_colour(tiff_of(colour, COMPRESSION_LZW, 3), "8-bit TIFF with 3 channels");
}

}  // namespace
}  // namespace ygslam
