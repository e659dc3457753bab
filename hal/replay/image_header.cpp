#include "hal/replay/image_header.hpp"

#include "hal/replay/intrinsics_file.hpp"

namespace tactus::hal::replay {
namespace {

constexpr std::string_view kPngSignature("\x89PNG\r\n\x1a\n", 8);

std::uint32_t byte_at(std::string_view bytes, std::size_t i) { return static_cast<unsigned char>(bytes[i]); }
std::uint32_t big16(std::string_view b, std::size_t i) { return byte_at(b, i) << 8 | byte_at(b, i + 1); }
std::uint32_t big32(std::string_view b, std::size_t i) { return big16(b, i) << 16 | big16(b, i + 2); }

rt::Error fault(std::string_view what) { return {rt::ExitCode::bad_input, std::string(what)}; }

rt::Result<ImageHeader> parse_png(std::string_view bytes) {
  // Signature 8, chunk length 4, "IHDR" 4, then width 4, height 4, bit depth, colour type, three method
  // bytes, CRC 4.
  constexpr std::size_t kHeaderBytes = 33;
  if (bytes.size() < kHeaderBytes) return fault("truncated inside the PNG header");
  if (big32(bytes, 8) != 13 || bytes.substr(12, 4) != "IHDR")
    return fault("a PNG whose first chunk is not IHDR");
  ImageHeader out;
  out.format = ImageFormat::png;
  out.width = big32(bytes, 16);
  out.height = big32(bytes, 20);
  const std::uint32_t bits = byte_at(bytes, 24);
  const std::uint32_t color_type = byte_at(bytes, 25);
  switch (color_type) {
    case 0:
      out.channels = 1;
      break;
    case 2:
      out.channels = 3;
      break;
    case 3:
      out.channels = 1;
      break;
    case 4:
      out.channels = 2;
      break;
    case 6:
      out.channels = 4;
      break;
    default:
      return fault("a PNG of no known colour type");
  }
  out.has_palette = color_type == 3;
  const bool whole = bits == 8 || bits == 16;
  const bool small = bits == 1 || bits == 2 || bits == 4;
  const bool legal = color_type == 0 ? whole || small : color_type == 3 ? small || bits == 8 : whole;
  if (!legal)
    return fault("a PNG of " + std::to_string(bits) + " bits, which its colour type does not allow");
  out.bits_per_channel = static_cast<int>(bits);
  return out;
}

rt::Result<ImageHeader> parse_jpeg(std::string_view bytes) {
  std::size_t i = 2;
  for (;;) {
    while (i < bytes.size() && byte_at(bytes, i) == 0xFF) ++i;  // fill bytes before a marker
    if (i + 2 >= bytes.size()) return fault("truncated before the JPEG frame header");
    if (byte_at(bytes, i - 1) != 0xFF) return fault("a JPEG with bytes between its segments");
    const std::uint32_t marker = byte_at(bytes, i);
    ++i;
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7)) {  // TEM, RSTn: no length follows
      if (byte_at(bytes, i) != 0xFF) return fault("a JPEG with bytes between its segments");
      continue;
    }
    if (marker == 0xDA || marker == 0xD9) return fault("a JPEG without a frame header");
    const std::uint32_t length = big16(bytes, i);
    if (length < 2) return fault("a JPEG segment of impossible length");
    const bool is_frame =
        marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (is_frame) {
      if (length < 8 || i + 8 > bytes.size()) return fault("truncated inside the JPEG frame header");
      ImageHeader out;
      out.format = ImageFormat::jpeg;
      out.bits_per_channel = static_cast<int>(byte_at(bytes, i + 2));
      out.height = big16(bytes, i + 3);
      out.width = big16(bytes, i + 5);
      out.channels = static_cast<int>(byte_at(bytes, i + 7));
      return out;
    }
    i += length;
    if (i < bytes.size() && byte_at(bytes, i) != 0xFF) return fault("a JPEG with bytes between its segments");
  }
}

}  // namespace

rt::Result<ImageHeader> parse_image_header(std::string_view bytes) {
  if (bytes.empty()) return fault("the file is empty");
  if (bytes.starts_with(kPngSignature)) return parse_png(bytes);
  if (bytes.starts_with("\xFF\xD8")) return parse_jpeg(bytes);
  return fault("neither PNG nor JPEG");
}

std::string fault_of(const ImageHeader& header, ImageUse use, int width, int height) {
  const bool is_png = header.format == ImageFormat::png;
  const std::string bits = std::to_string(header.bits_per_channel);
  const std::string found = (is_png ? "a PNG of " : "a JPEG of ") + bits + " bits and " +
                            std::to_string(header.channels) +
                            (header.has_palette ? " palette channel" : " channels");
  const bool is_grey = is_png && header.channels == 1 && !header.has_palette;
  switch (use) {
    case ImageUse::depth:
      if (!is_grey || header.bits_per_channel != 16) return found + "; depth is a 16-bit greyscale PNG";
      break;
    case ImageUse::label:
      if (!is_grey || header.bits_per_channel != 8) return found + "; labels are an 8-bit greyscale PNG";
      break;
    case ImageUse::color:
      if (header.bits_per_channel > 8 || (!is_png && header.channels != 1 && header.channels != 3) ||
          (!is_png && header.bits_per_channel != 8))
        return found + "; colour is PNG or JPEG with 8 bits per channel";
      break;
  }
  const auto as_text = [](auto w, auto h) { return std::to_string(w) + "x" + std::to_string(h); };
  if (width == 0 && height == 0) {
    if (header.width < 1 || header.height < 1 || header.width > static_cast<std::uint32_t>(kImageSideMax) ||
        header.height > static_cast<std::uint32_t>(kImageSideMax) ||
        static_cast<std::uint64_t>(header.width) * header.height >
            static_cast<std::uint64_t>(kImagePixelsMax))
      return as_text(header.width, header.height) +
             " pixels is no image size; at most 8192 a side, 16 Mpixel together";
  } else if (header.width != static_cast<std::uint32_t>(width) ||
             header.height != static_cast<std::uint32_t>(height)) {
    return as_text(header.width, header.height) + " pixels, but the calibration says " +
           as_text(width, height);
  }
  return {};
}

}  // namespace tactus::hal::replay
