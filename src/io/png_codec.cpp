#include "io/png_codec.hpp"

#include <png.h>

#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstdlib>
#include <cstring>
#include <new>

#include "io/plain_png.hpp"

namespace ygslam::png {
namespace {

// libpng reports errors by longjmp. Everything with a destructor lives outside the functions that
// call setjmp, so that the jump skips no destructor.
struct Source {
  std::string_view rest;
  bool ran_out = false;
  bool out_of_memory = false;
  char fault[96] = {};
};

void read_bytes(png_structp png, png_bytep out, std::size_t count) {
  auto* source = static_cast<Source*>(png_get_io_ptr(png));
  if (source->rest.size() < count) {
    source->ran_out = true;
    png_error(png, "end of file");
  }
  std::memcpy(out, source->rest.data(), count);
  source->rest.remove_prefix(count);
}

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  auto* source = static_cast<Source*>(png_get_error_ptr(png));
  std::snprintf(source->fault, sizeof source->fault, "%s", message);
  png_longjmp(png, 1);
}

void on_warning(png_structp /*png*/, png_const_charp /*message*/) {}

void* allocate(png_structp png, png_alloc_size_t bytes) {
  void* const memory = std::malloc(bytes);
  if (memory == nullptr) static_cast<Source*>(png_get_mem_ptr(png))->out_of_memory = true;
  return memory;
}
void release(png_structp /*png*/, void* memory) { std::free(memory); }

/// Throws std::bad_alloc where that is what libpng lacked.
Error fault_of(const Source& source) {
  if (source.out_of_memory) throw std::bad_alloc();
  return {ErrorKind::kInput, source.ran_out ? std::string("truncated PNG")
                                            : std::string("corrupt PNG (") + source.fault + ")"};
}

class Reader {
 public:
  explicit Reader(Source& source)
      : png_(png_create_read_struct_2(PNG_LIBPNG_VER_STRING, &source, on_error, on_warning, &source,
                                      allocate, release)),
        info_(png_ != nullptr ? png_create_info_struct(png_) : nullptr) {
    if (info_ == nullptr) {
      png_destroy_read_struct(&png_, nullptr, nullptr);
      throw std::bad_alloc();
    }
    png_set_read_fn(png_, &source, read_bytes);
    png_set_user_limits(png_, kMaxImageSide_px, kMaxImageSide_px);
    png_set_benign_errors(png_, 0);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() { png_destroy_read_struct(&png_, &info_, nullptr); }

  png_structp png() { return png_; }
  png_infop info() { return info_; }

 private:
  png_structp png_;
  png_infop info_;
};

// Where an error can jump to only.
void read_info(Reader& reader) {
  // Colour profiles and texts are of no interest and a frequent source of faults.
  png_set_keep_unknown_chunks(reader.png(), PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  png_read_info(reader.png(), reader.info());
}

bool run_header(Reader& reader) {
  if (setjmp(png_jmpbuf(reader.png())) != 0) return false;
  read_info(reader);
  return true;
}

bool run_decode(Reader& reader, png_bytep* rows) {
  png_structp png = reader.png();
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  read_info(reader);
  if (std::endian::native == std::endian::little && png_get_bit_depth(png, reader.info()) == 16) {
    png_set_swap(png);
  }
  if (png_get_color_type(png, reader.info()) == PNG_COLOR_TYPE_PALETTE) {
    png_set_palette_to_rgb(png);
    png_set_strip_alpha(png);
  } else if (png_get_bit_depth(png, reader.info()) < 8) {
    png_set_expand_gray_1_2_4_to_8(png);
  }
  png_set_interlace_handling(png);
  png_read_update_info(png, reader.info());
  png_read_image(png, rows);
  png_read_end(png, nullptr);  // the check sums of what follows, and that the file is complete
  return true;
}

void append_bytes(png_structp png, png_bytep bytes, std::size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(bytes), count);
}
void no_flush(png_structp /*png*/) {}

bool run_encode(png_structp png, png_infop info, png_bytep* rows, const ImageHeader& header,
                int compression, PngFilter filter) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_IHDR(png, info, static_cast<png_uint_32>(header.size.width),
               static_cast<png_uint_32>(header.size.height), header.bits,
               header.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, compression);
  if (filter == PngFilter::kNone) png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);
  if (filter == PngFilter::kUp) png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
  png_write_info(png, info);
  if (std::endian::native == std::endian::little && header.bits == 16) png_set_swap(png);
  png_write_image(png, rows);
  png_write_end(png, info);
  return true;
}

std::vector<png_bytep> row_pointers(std::uint8_t* pixels, const ImageHeader& header) {
  const std::size_t stride = static_cast<std::size_t>(header.size.width) *
                             (header.palette ? 3 : header.channels) * std::max(1, header.bits / 8);
  std::vector<png_bytep> rows(static_cast<std::size_t>(header.size.height));
  for (std::size_t v = 0; v < rows.size(); ++v) rows[v] = pixels + v * stride;
  return rows;
}

}  // namespace

bool has_signature(std::string_view bytes) {
  return bytes.size() >= 8 &&
         png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0, 8) == 0;
}

Result<ImageHeader> header(std::string_view bytes) {
  Source source{bytes};
  Reader reader(source);
  if (!run_header(reader)) return fault_of(source);
  ImageHeader header;
  header.size = {static_cast<int>(png_get_image_width(reader.png(), reader.info())),
                 static_cast<int>(png_get_image_height(reader.png(), reader.info()))};
  header.channels = png_get_channels(reader.png(), reader.info());
  header.bits = png_get_bit_depth(reader.png(), reader.info());
  header.palette = png_get_color_type(reader.png(), reader.info()) == PNG_COLOR_TYPE_PALETTE;
  return header;
}

Status decode(std::string_view bytes, std::uint8_t* pixels) {
  const auto known = header(bytes);
  if (!known.ok()) return known.error();
  if (decode_plain(bytes, *known, pixels)) return Ok{};
  Source source{bytes};
  Reader reader(source);
  std::vector<png_bytep> rows = row_pointers(pixels, *known);
  if (!run_decode(reader, rows.data())) return fault_of(source);
  return Ok{};
}

std::string encode(const std::uint8_t* pixels, const ImageHeader& header, int compression,
                   PngFilter filter) {
  std::string bytes;
  Source faults;
  png_structp png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &faults, on_error, on_warning,
                                              &faults, allocate, release);
  png_infop info = png_create_info_struct(png);
  if (info == nullptr) {
    png_destroy_write_struct(&png, nullptr);
    throw std::bad_alloc();
  }
  png_set_write_fn(png, &bytes, append_bytes, no_flush);
  // libpng does not write to the rows; its interface predates const.
  std::vector<png_bytep> rows = row_pointers(const_cast<std::uint8_t*>(pixels), header);
  const bool written = run_encode(png, info, rows.data(), header, compression, filter);
  png_destroy_write_struct(&png, &info);
  CHECK(written, fault_of(faults).message.c_str());
  return bytes;
}

}  // namespace ygslam::png
