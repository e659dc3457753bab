#include "hal/v4l2/node.hpp"

#include <fcntl.h>
#include <grp.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <utility>

namespace tactus::hal::v4l2 {
namespace {

constexpr int kNodesMax = 256;  // minors of the kernel's video4linux class
// Of what a driver enumerates; real ones have tens.
constexpr std::uint32_t kFormatsMax = 256, kSizesMax = 256, kIntervalsMax = 256;

int number_in(std::string_view text) noexcept {
  int number = -1;
  (void)std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

int index_of(int fd) noexcept {
  std::array<char, 16> text;
  return number_in(read_beside(fd, "index", text));
}

template <std::size_t Size, typename Byte>
void copy_text(std::array<char, Size>& to, const Byte* from) noexcept {
  std::memcpy(to.data(), from, Size);
  to.back() = '\0';
}

Interval to_interval(const v4l2_fract& fraction) { return {fraction.numerator, fraction.denominator}; }

void add_intervals(int fd, std::uint32_t fourcc, const ModeRequest& mode, SizeOffer& offer) {
  v4l2_frmivalenum ask{};
  ask.pixel_format = fourcc;
  ask.width = static_cast<std::uint32_t>(offer.width.nearest(mode.width > 0 ? mode.width : 640));
  ask.height = static_cast<std::uint32_t>(offer.height.nearest(mode.height > 0 ? mode.height : 480));
  for (ask.index = 0; ask.index < kIntervalsMax && call(fd, VIDIOC_ENUM_FRAMEINTERVALS, &ask) == 0; ++ask.index) {
    if (ask.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      offer.intervals.push_back(to_interval(ask.discrete));
      continue;
    }
    offer.is_interval_range = true;
    offer.intervals = {to_interval(ask.stepwise.min), to_interval(ask.stepwise.max)};
    return;
  }
}

FormatOffer offer_of(int fd, std::uint32_t fourcc, const ModeRequest& mode) {
  FormatOffer offer{fourcc, {}};
  v4l2_frmsizeenum ask{};
  ask.pixel_format = fourcc;
  for (ask.index = 0; ask.index < kSizesMax && call(fd, VIDIOC_ENUM_FRAMESIZES, &ask) == 0; ++ask.index) {
    SizeOffer size;
    if (ask.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      const auto width = static_cast<int>(ask.discrete.width), height = static_cast<int>(ask.discrete.height);
      size.width = {width, width, 1};
      size.height = {height, height, 1};
    } else {
      const v4l2_frmsize_stepwise& s = ask.stepwise;
      size.width = {static_cast<int>(s.min_width), static_cast<int>(s.max_width), static_cast<int>(s.step_width)};
      size.height = {static_cast<int>(s.min_height), static_cast<int>(s.max_height), static_cast<int>(s.step_height)};
    }
    if (size.width.min < 1 || size.height.min < 1 || size.width.max < size.width.min || size.height.max < size.height.min)
      continue;
    add_intervals(fd, fourcc, mode, size);
    offer.sizes.push_back(std::move(size));
    if (ask.type != V4L2_FRMSIZE_TYPE_DISCRETE) break;
  }
  return offer;
}

/// What a driver without VIDIOC_ENUM_FRAMESIZES has now: the one size that is known to work.
void add_present_size(int fd, bool is_multiplanar, FormatOffer& offer) {
  v4l2_format format{};
  format.type = is_multiplanar ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (call(fd, VIDIOC_G_FMT, &format) != 0) return;
  const auto width = static_cast<int>(is_multiplanar ? format.fmt.pix_mp.width : format.fmt.pix.width);
  const auto height = static_cast<int>(is_multiplanar ? format.fmt.pix_mp.height : format.fmt.pix.height);
  if (width < 1 || height < 1) return;
  offer.sizes.push_back({{width, width, 1}, {height, height, 1}, {}, false});
}

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    close();
    fd_ = std::exchange(other.fd_, -1);
  }
  return *this;
}

void Descriptor::close() noexcept {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

int call(int fd, unsigned long request, void* argument) noexcept {
  int answer;
  do {
    answer = ::ioctl(fd, request, argument);
  } while (answer < 0 && errno == EINTR);
  return answer < 0 ? errno : 0;
}

std::string_view read_file(const char* path, std::span<char> text) noexcept {
  const Descriptor file(::open(path, O_RDONLY | O_CLOEXEC));
  if (!file.is_open()) return {};
  std::size_t size = 0;
  while (size < text.size()) {
    const ssize_t got = ::read(file.get(), text.data() + size, text.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    size += static_cast<std::size_t>(got);
  }
  return {text.data(), size};
}

bool NodeInfo::is_capture() const {
  constexpr std::uint32_t kCapture = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE;
  constexpr std::uint32_t kCodec = V4L2_CAP_VIDEO_M2M | V4L2_CAP_VIDEO_M2M_MPLANE | V4L2_CAP_VIDEO_OUTPUT |
                                   V4L2_CAP_VIDEO_OUTPUT_MPLANE;
  return (capabilities & kCapture) != 0 && (capabilities & kCodec) == 0 && (capabilities & V4L2_CAP_STREAMING) != 0;
}

bool NodeInfo::is_multiplanar() const { return (capabilities & V4L2_CAP_VIDEO_CAPTURE) == 0; }

bool NodeInfo::is_metadata() const { return (capabilities & V4L2_CAP_META_CAPTURE) != 0; }

Descriptor open_node(const char* path, int& error) noexcept {
  Descriptor node(::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC));
  error = node.is_open() ? 0 : errno;
  return node;
}

int read_info(int fd, NodeInfo& info) noexcept {
  v4l2_capability capability{};
  if (const int error = call(fd, VIDIOC_QUERYCAP, &capability); error != 0) return error;
  copy_text(info.driver, capability.driver);
  copy_text(info.card, capability.card);
  copy_text(info.bus_info, capability.bus_info);
  info.capabilities = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                           : capability.capabilities;
  info.index = index_of(fd);
  return 0;
}

Descriptor find_node(const NodeInfo& wanted, bool (NodeInfo::*is_wanted)() const, NodePath& path) noexcept {
  for (int number = 0; number < kNodesMax; ++number) {
    std::snprintf(path.data(), path.size(), "/sys/class/video4linux/video%d/index", number);
    std::array<char, 16> text;
    const std::string_view index = read_file(path.data(), text);
    if (wanted.index >= 0 && (index.empty() || number_in(index) != wanted.index)) continue;
    std::snprintf(path.data(), path.size(), "/dev/video%d", number);
    int error = 0;
    Descriptor node = open_node(path.data(), error);
    NodeInfo info;
    if (!node.is_open() || read_info(node.get(), info) != 0) continue;
    if (info.driver == wanted.driver && info.bus_info == wanted.bus_info && info.index == wanted.index &&
        (info.*is_wanted)())
      return node;
  }
  return {};
}

std::string_view read_beside(int fd, const char* file, std::span<char> text) noexcept {
  struct stat status {};
  if (::fstat(fd, &status) != 0) return {};
  std::array<char, 128> path;
  std::snprintf(path.data(), path.size(), "/sys/dev/char/%u:%u/%s", major(status.st_rdev), minor(status.st_rdev), file);
  return read_file(path.data(), text);
}

std::vector<FormatOffer> enumerate_offers(int fd, bool is_multiplanar, const ModeRequest& mode) {
  std::vector<FormatOffer> offers;
  v4l2_fmtdesc ask{};
  ask.type = is_multiplanar ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (ask.index = 0; ask.index < kFormatsMax && call(fd, VIDIOC_ENUM_FMT, &ask) == 0; ++ask.index) {
    const auto is_same = [&](const FormatOffer& offer) { return offer.fourcc == ask.pixelformat; };
    if (std::any_of(offers.begin(), offers.end(), is_same)) continue;
    FormatOffer offer = offer_of(fd, ask.pixelformat, mode);
    if (offer.sizes.empty()) add_present_size(fd, is_multiplanar, offer);
    offers.push_back(std::move(offer));
  }
  return offers;
}

std::string name_for_people(std::string_view path, const NodeInfo& info) {
  return std::string(path) + " (" + info.card.data() + ")";
}

std::string open_trouble(const std::string& path, int error) {
  if (error == EACCES || error == EPERM) {
    struct stat status {};
    const group* owner = ::stat(path.c_str(), &status) == 0 ? ::getgrgid(status.st_gid) : nullptr;
    const std::string name = owner != nullptr && status.st_gid != 0 ? owner->gr_name : "video";
    return "no permission to open " + path + "; join the group " + name + " (sudo usermod -aG " + name +
           " $USER) and log in again";
  }
  if (error == ENOENT) return path + " does not exist; tactus devices lists the cameras that are plugged in";
  if (error == EBUSY) return path + " is in use by another program; close it first";
  if (error == ENODEV || error == ENXIO) return path + " has no device behind it any more; plug it in again";
  return "cannot open " + path + ": " + std::strerror(error);
}

}  // namespace tactus::hal::v4l2
