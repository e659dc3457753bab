// No object with a destructor lives in a function that setjmp() returns into.
#include "hal/frames/jpeg_codec.hpp"

#include <cstddef>
#include <cstdio>
// jpeglib.h uses size_t and FILE and includes neither: it stays below them.
// clang-format off
#include <jpeglib.h>
#include <jerror.h>
// clang-format on

#include <array>
#include <csetjmp>
#include <cstdlib>
#include <cstring>

namespace tactus::hal::frames {
namespace {

/// The first member is libjpeg's, so that its pointer is ours.
struct Context {
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  std::jmp_buf jump;
  std::array<char, JMSG_LENGTH_MAX> message{};
  StrayBytes stray = StrayBytes::refused;
};

[[noreturn]] void on_error(j_common_ptr info) {
  auto* context = reinterpret_cast<Context*>(info->err);
  info->err->format_message(info, context->message.data());
  std::longjmp(context->jump, 1);
}

/// A warning (level -1: data damaged or short) is an error here; levels 0 and up are chatter.
void on_message(j_common_ptr info, int level) {
  if (level >= 0) return;
  constexpr int kEndMark = 0xD9;
  const bool is_stray = info->err->msg_code == JWRN_EXTRANEOUS_DATA && info->err->msg_parm.i[1] == kEndMark;
  if (is_stray && reinterpret_cast<Context*>(info->err)->stray == StrayBytes::ignored) return;
  on_error(info);
}

/// A progressive file may repeat scans without end, each as slow as the first; real ones have about ten.
void on_progress(j_common_ptr info) {
  constexpr int kScansMax = 64;
  if (!info->is_decompressor) return;
  if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number <= kScansMax) return;
  auto* context = reinterpret_cast<Context*>(info->err);
  std::strncpy(context->message.data(), "more than 64 scans", context->message.size() - 1);
  std::longjmp(context->jump, 1);
}

void set_up(Context& context) {
  jpeg_std_error(&context.errors);
  context.errors.error_exit = on_error;
  context.errors.emit_message = on_message;
  context.progress.progress_monitor = on_progress;
}

bool decode_rows(Context& context, jpeg_decompress_struct& info, const unsigned char* bytes,
                 unsigned long bytes_count, std::uint32_t width, std::uint32_t height, std::uint8_t* rgb) {
  if (setjmp(context.jump) != 0) return false;
  jpeg_create_decompress(&info);
  info.progress = &context.progress;
  jpeg_mem_src(&info, bytes, bytes_count);
  jpeg_read_header(&info, TRUE);
  info.out_color_space = JCS_RGB;
  info.dct_method = JDCT_ISLOW;  // the integer transform: the same pixels with and without SIMD
  if (info.image_width != width || info.image_height != height) {
    std::strncpy(context.message.data(), "of another size", context.message.size() - 1);
    return false;
  }
  jpeg_start_decompress(&info);
  if (info.output_components != 3) {
    std::strncpy(context.message.data(), "not three channels", context.message.size() - 1);
    return false;
  }
  while (info.output_scanline < height) {
    JSAMPROW row = rgb + static_cast<std::size_t>(info.output_scanline) * width * 3;
    if (jpeg_read_scanlines(&info, &row, 1) != 1) return false;
  }
  jpeg_finish_decompress(&info);
  return true;
}

bool encode_rows(Context& context, jpeg_compress_struct& info, unsigned char** bytes, unsigned long* bytes_count,
                 std::uint32_t width, std::uint32_t height, const std::uint8_t* rgb, int quality) {
  if (setjmp(context.jump) != 0) return false;
  jpeg_create_compress(&info);
  jpeg_mem_dest(&info, bytes, bytes_count);
  info.image_width = width;
  info.image_height = height;
  info.input_components = 3;
  info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, quality, TRUE);
  info.comp_info[0].h_samp_factor = 1;
  info.comp_info[0].v_samp_factor = 1;
  info.dct_method = JDCT_ISLOW;
  jpeg_start_compress(&info, TRUE);
  while (info.next_scanline < height) {
    // libjpeg takes rows it will not write to as pointers to non-const.
    JSAMPROW row = const_cast<JSAMPROW>(rgb + static_cast<std::size_t>(info.next_scanline) * width * 3);
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  return true;
}

}  // namespace

std::string decode_jpeg(std::string_view bytes, int width, int height, std::span<std::uint8_t> rgb, StrayBytes stray) {
  TACTUS_ASSERT(rgb.size() == 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  Context context;
  set_up(context);
  context.stray = stray;
  jpeg_decompress_struct info{};
  info.err = &context.errors;
  const bool decoded =
      decode_rows(context, info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(),
                  static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), rgb.data());
  jpeg_destroy_decompress(&info);
  return decoded ? std::string{} : "a damaged JPEG (" + std::string(context.message.data()) + ")";
}

bool encode_jpeg(std::span<const std::uint8_t> rgb, int width, int height, int quality,
                 std::vector<std::uint8_t>& bytes) {
  TACTUS_ASSERT(rgb.size() == 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  Context context;
  set_up(context);
  jpeg_compress_struct info{};
  info.err = &context.errors;
  unsigned char* encoded = nullptr;
  unsigned long encoded_count = 0;
  const bool is_encoded = encode_rows(context, info, &encoded, &encoded_count, static_cast<std::uint32_t>(width),
                                      static_cast<std::uint32_t>(height), rgb.data(), quality);
  jpeg_destroy_compress(&info);
  if (is_encoded) bytes.assign(encoded, encoded + encoded_count);
  std::free(encoded);
  return is_encoded;
}

}  // namespace tactus::hal::frames
