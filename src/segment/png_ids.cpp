#include "segment/png_ids.hpp"

#include <png.h>

#include <csetjmp>
#include <cstdio>
#include <memory>
#include <new>
#include <vector>

namespace ygslam {
namespace {

constexpr png_uint_32 kMaxIdSide = 8192;

struct Reader {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string fault;
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
};

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  static_cast<Reader*>(png_get_error_ptr(png))->fault = message;
  png_longjmp(png, 1);
}
void on_warning(png_structp /*png*/, png_const_charp /*message*/) {}

// The two functions that call libpng's reading part own nothing themselves: its errors jump back
// to their setjmp.

bool read_header(Reader& reader, std::FILE* file, png_uint_32& width, png_uint_32& height) {
  if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
  png_init_io(reader.png, file);
  png_set_user_limits(reader.png, kMaxIdSide, kMaxIdSide);
  // Texts are of no interest, and libpng takes memory for them by the size they announce.
  png_set_keep_unknown_chunks(reader.png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  png_read_info(reader.png, reader.info);
  width = png_get_image_width(reader.png, reader.info);
  height = png_get_image_height(reader.png, reader.info);
  const int colours = png_get_color_type(reader.png, reader.info);
  if (colours != PNG_COLOR_TYPE_GRAY && colours != PNG_COLOR_TYPE_PALETTE) {
    png_error(reader.png, "is neither grey nor of palette colours");
  }
  if (png_get_bit_depth(reader.png, reader.info) > 8) png_error(reader.png, "has more than 8 bits");
  png_set_packing(reader.png);
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

bool read_rows(Reader& reader, png_bytep* rows) {
  if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return true;
}

}  // namespace

Result<GreyImage> read_png_ids(const std::filesystem::path& file) {
  const auto fault = [&](const std::string& what) {
    return Error{ErrorKind::kInput, file.string() + ": " + what};
  };
  std::error_code code;
  if (std::filesystem::exists(file, code) && !std::filesystem::is_regular_file(file, code)) {
    return fault("not a regular file");  // opening a pipe would wait for ever
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"),
                                                               &std::fclose);
  if (!stream) return fault("cannot be opened");
  Reader reader;
  reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader, on_error, on_warning);
  reader.info = reader.png != nullptr ? png_create_info_struct(reader.png) : nullptr;
  if (reader.info == nullptr) throw std::bad_alloc();

  png_uint_32 width = 0;
  png_uint_32 height = 0;
  if (!read_header(reader, stream.get(), width, height)) return fault(reader.fault);
  GreyImage ids(static_cast<int>(width), static_cast<int>(height));
  std::vector<png_bytep> rows(height);
  for (png_uint_32 v = 0; v < height; ++v) rows[v] = ids.row(static_cast<int>(v));
  if (!read_rows(reader, rows.data())) return fault(reader.fault);
  return ids;
}

}  // namespace ygslam
