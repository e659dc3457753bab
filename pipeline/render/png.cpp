#include "pipeline/render/png.hpp"

#include <png.h>

#include <string>

namespace tactus::render {
namespace {

png_image describe(std::span<const std::uint8_t> rgb, int width_px, int height_px) {
  TACTUS_ASSERT(width_px > 0 && height_px > 0);
  TACTUS_ASSERT(rgb.size() == static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width_px);
  image.height = static_cast<png_uint_32>(height_px);
  image.format = PNG_FORMAT_RGB;
  return image;
}

rt::Error failed(const std::string& target, const png_image& image) {
  return {rt::ExitCode::failed, "cannot write the picture " + target + ": " + image.message};
}

}  // namespace

rt::Result<void> write_png(const std::filesystem::path& path, std::span<const std::uint8_t> rgb, int width_px,
                           int height_px) {
  png_image image = describe(rgb, width_px, height_px);
  if (png_image_write_to_file(&image, path.c_str(), 0, rgb.data(), 0, nullptr) == 0)
    return failed(path.string(), image);
  return {};
}

rt::Result<std::vector<std::uint8_t>> encode_png(std::span<const std::uint8_t> rgb, int width_px,
                                                 int height_px) {
  png_image image = describe(rgb, width_px, height_px);
  png_alloc_size_t bytes_count = 0;
  if (png_image_write_to_memory(&image, nullptr, &bytes_count, 0, rgb.data(), 0, nullptr) == 0)
    return failed("to memory", image);
  std::vector<std::uint8_t> bytes(bytes_count);
  if (png_image_write_to_memory(&image, bytes.data(), &bytes_count, 0, rgb.data(), 0, nullptr) == 0)
    return failed("to memory", image);
  bytes.resize(bytes_count);
  return bytes;
}

}  // namespace tactus::render
