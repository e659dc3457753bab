#include "tests/guest/usb_camera/clip.hpp"

#include <array>
#include <cstring>
#include <fstream>
#include <string>

#include "rt/assert.hpp"
#include "tests/guest/usb_camera/yuyv.hpp"

namespace tactus::guest {
namespace {

using namespace rt::literals;

// The file is this, then the frames.
struct FileHead {
  std::array<char, 8> magic{'t', 'a', 'c', 't', 'c', 'l', 'i', 'p'};
  std::int32_t width = 0, height = 0;
};

rt::Error unreadable(const std::filesystem::path& file, const std::string& why) {
  return {rt::ExitCode::bad_input, file.string() + ": " + why + "; make it with guest_render_clip."};
}

}  // namespace

rt::Result<Clip> Clip::render(hal::Sensor& sensor) {
  const hal::RigCalibration& rig = sensor.calibration;
  if (!rig.has_color || !rig.registered)
    return rt::Error{rt::ExitCode::bad_usage, "A clip needs colour that is registered to depth."};
  Clip clip(rig.depth.width, rig.depth.height);
  const std::size_t pixels = clip.frame_bytes() / 2;
  std::vector<std::uint16_t> depth(pixels);
  std::vector<std::uint8_t> rgb(3 * pixels), depth_bytes(2 * pixels), yuyv(2 * pixels);
  hal::FrameHeader header;
  for (;;) {
    const rt::Status got = sensor.depth->read(depth, header, 1_s);
    if (got == rt::Status::end_of_stream) return clip;
    if (got != rt::Status::ok || sensor.color->read(rgb, header, 1_s) != rt::Status::ok)
      return rt::Error{rt::ExitCode::bad_input, sensor.description + ": a frame cannot be read."};
    std::memcpy(depth_bytes.data(), depth.data(), depth_bytes.size());
    to_yuyv(rgb, yuyv);
    clip.append(depth_bytes, yuyv);
  }
}

rt::Result<Clip> Clip::read(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  FileHead head;
  if (!in.read(reinterpret_cast<char*>(&head), sizeof(head))) return unreadable(file, "cannot be read");
  if (head.magic != FileHead{}.magic || head.width < 2 || head.height < 2 || head.width > 4096 || head.height > 4096)
    return unreadable(file, "is no clip");
  Clip clip(head.width, head.height);
  clip.bytes_.assign(std::istreambuf_iterator<char>(in), {});
  if (clip.bytes_.empty() || clip.bytes_.size() % (2 * clip.frame_bytes()) != 0)
    return unreadable(file, "ends in the middle of a frame");
  return clip;
}

rt::Result<void> Clip::write(const std::filesystem::path& file) const {
  std::ofstream out(file, std::ios::binary);
  FileHead head;
  head.width = width_;
  head.height = height_;
  out.write(reinterpret_cast<const char*>(&head), sizeof(head));
  out.write(reinterpret_cast<const char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
  out.close();
  if (!out) return rt::Error{rt::ExitCode::failed, file.string() + " cannot be written; is the disk full?"};
  return {};
}

void Clip::append(std::span<const std::uint8_t> depth, std::span<const std::uint8_t> yuyv) {
  TACTUS_ASSERT(depth.size() == frame_bytes() && yuyv.size() == frame_bytes());
  bytes_.insert(bytes_.end(), depth.begin(), depth.end());
  bytes_.insert(bytes_.end(), yuyv.begin(), yuyv.end());
}

std::span<const std::uint8_t> Clip::frame(hal::PixelFormat format, std::size_t index) const {
  const std::size_t place = 2 * index + (format == hal::PixelFormat::depth16 ? 0 : 1);
  return std::span(bytes_).subspan(place * frame_bytes(), frame_bytes());
}

}  // namespace tactus::guest
