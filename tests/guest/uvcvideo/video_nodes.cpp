#include "tests/guest/uvcvideo/video_nodes.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "rt/clock.hpp"

namespace tactus::guest {
namespace {

using namespace rt::literals;

bool gives_images(const std::string& node, const std::string& name) {
  const int file = open(node.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) return false;
  v4l2_capability capability{};
  const bool is_asked = ioctl(file, VIDIOC_QUERYCAP, &capability) == 0;
  close(file);
  return is_asked && reinterpret_cast<const char*>(capability.card) == name &&
         (capability.device_caps & V4L2_CAP_VIDEO_CAPTURE) != 0;
}

}  // namespace

std::vector<std::string> video_nodes(const std::string& name) {
  std::vector<std::string> nodes;
  constexpr int kNodesMax = 64;
  for (int i = 0; i < kNodesMax; ++i) {
    const std::string node = "/dev/video" + std::to_string(i);
    if (gives_images(node, name)) nodes.push_back(node);
  }
  return nodes;
}

std::vector<std::string> await_video_nodes(const std::string& name, std::size_t count, rt::Duration patience) {
  const rt::Clock clock = rt::Clock::monotonic();
  const rt::HostTime end = clock.now() + patience;
  for (;;) {
    auto nodes = video_nodes(name);
    if (nodes.size() >= count || clock.now() > end) return nodes;
    clock.sleep_until(clock.now() + 100_ms);
  }
}

}  // namespace tactus::guest
