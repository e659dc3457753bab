#include "hal/egl/kms/screen.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <xf86drm.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <tuple>
#include <vector>

namespace tactus::hal::egl {
namespace {

struct Free {
  void operator()(drmModeRes* resources) const { drmModeFreeResources(resources); }
  void operator()(drmModeConnector* connector) const { drmModeFreeConnector(connector); }
  void operator()(drmModeEncoder* encoder) const { drmModeFreeEncoder(encoder); }
};
template <typename T>
using Handle = std::unique_ptr<T, Free>;

// The CRTC that feeds the connector already, or the first one that can; 0: none.
std::uint32_t find_crtc(int card, const drmModeRes& resources, const drmModeConnector& connector) {
  if (const Handle<drmModeEncoder> now{drmModeGetEncoder(card, connector.encoder_id)};
      now != nullptr && now->crtc_id != 0)
    return now->crtc_id;
  for (int i = 0; i < connector.count_encoders; ++i) {
    const Handle<drmModeEncoder> encoder{drmModeGetEncoder(card, connector.encoders[i])};
    for (int c = 0; encoder != nullptr && c < resources.count_crtcs; ++c)
      if ((encoder->possible_crtcs & (1U << c)) != 0) return resources.crtcs[c];
  }
  return 0;
}

// Fills `screen` in, or answers why not.
std::string open_screen(const std::string& device, Screen& screen) {
  screen.card = Descriptor(::open(device.c_str(), O_RDWR | O_CLOEXEC));
  const int card = screen.card.number();
  if (card < 0) return std::strerror(errno);
  const Handle<drmModeRes> resources{drmModeGetResources(card)};
  if (resources == nullptr) return "drives no screens";
  for (int i = 0; i < resources->count_connectors; ++i) {
    const Handle<drmModeConnector> connector{drmModeGetConnector(card, resources->connectors[i])};
    if (connector == nullptr || connector->connection != DRM_MODE_CONNECTED || connector->count_modes == 0)
      continue;
    screen.crtc = find_crtc(card, *resources, *connector);
    if (screen.crtc == 0) continue;
    screen.connector = connector->connector_id;
    screen.mode = choose_mode({connector->modes, static_cast<std::size_t>(connector->count_modes)});
    return {};
  }
  return "no screen is connected";
}

std::vector<std::string> cards(const std::string& folder) {
  std::vector<std::string> found;
  std::error_code error;
  for (auto it = std::filesystem::directory_iterator(folder, error); !error && it != std::filesystem::end(it);
       it.increment(error))
    if (it->path().filename().string().starts_with("card")) found.push_back(it->path().string());
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

const drmModeModeInfo& choose_mode(std::span<const drmModeModeInfo> modes) {
  const auto rank = [](const drmModeModeInfo& mode) {
    return std::tuple((mode.type & DRM_MODE_TYPE_PREFERRED) != 0, mode.hdisplay * mode.vdisplay,
                      mode.vrefresh);
  };
  return *std::max_element(modes.begin(), modes.end(),
                           [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
}

rt::Result<Screen> find_screen(const std::string& device, const std::string& folder) {
  std::string why;
  const auto candidates = device.empty() ? cards(folder) : std::vector{device};
  for (const std::string& candidate : candidates) {
    Screen screen;
    const std::string wrong = open_screen(candidate, screen);
    if (wrong.empty()) return screen;
    why += (why.empty() ? "" : ", ") + candidate + ": " + wrong;
  }
  if (candidates.empty()) why = "there is no graphics card in " + folder;
  return rt::Error{
      rt::ExitCode::device_unavailable,
      "no screen can be driven (" + why + "); connect one, or run with a window or without a display."};
}

}  // namespace tactus::hal::egl
