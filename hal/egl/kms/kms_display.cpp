// The screen by libdrm's mode setting; GBM's buffers carry what EGL draws to it.
#include "hal/egl/kms_display.hpp"

#include <gbm.h>
#include <poll.h>
#include <xf86drm.h>
#include <xf86drmMode.h>

#include <cerrno>
#include <cstring>
#include <optional>

#include "hal/egl/framebuffer.hpp"
#include "hal/egl/kms/screen.hpp"

namespace tactus::hal::egl {
namespace {

constexpr int kFlipTimeoutMs = 1000;  // a screen refreshes at 24 Hz or faster

struct Free {
  void operator()(gbm_device* device) const { gbm_device_destroy(device); }
  void operator()(gbm_surface* surface) const { gbm_surface_destroy(surface); }
  void operator()(drmModeCrtc* crtc) const { drmModeFreeCrtc(crtc); }
};
template <typename T>
using Handle = std::unique_ptr<T, Free>;

// The kernel's number of a buffer, made when it is first shown and kept with it; 0: it cannot be shown.
std::uint32_t framebuffer_of(gbm_bo* buffer) {
  if (const auto* known = gbm_bo_get_user_data(buffer))
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(known));
  std::uint32_t number = 0;
  if (drmModeAddFB(gbm_device_get_fd(gbm_bo_get_device(buffer)), gbm_bo_get_width(buffer),
                   gbm_bo_get_height(buffer), 24, 32, gbm_bo_get_stride(buffer),
                   gbm_bo_get_handle(buffer).u32, &number) != 0)
    return 0;
  gbm_bo_set_user_data(buffer, reinterpret_cast<void*>(static_cast<std::uintptr_t>(number)),
                       [](gbm_bo* gone, void* kept) {
                         drmModeRmFB(gbm_device_get_fd(gbm_bo_get_device(gone)),
                                     static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(kept)));
                       });
  return number;
}

}  // namespace

struct KmsDisplay::State {
  Screen screen;
  Handle<drmModeCrtc> before;  // what the screen showed when we came
  Handle<gbm_device> device;
  Handle<gbm_surface> surface;
  std::optional<Context> context;
  std::optional<Framebuffer> framebuffer;
  gbm_bo* shown = nullptr;   // on the screen
  gbm_bo* queued = nullptr;  // to be flipped to at the next refresh
  bool is_flip_done = false;
  std::uint64_t frames_presented = 0;

  ~State();
  [[nodiscard]] DisplayFormat screen_size() const { return {screen.mode.hdisplay, screen.mode.vdisplay}; }
  bool finish_flip() noexcept;
  bool show(gbm_bo* buffer) noexcept;
};

KmsDisplay::State::~State() {
  finish_flip();
  if (before != nullptr && shown != nullptr)
    drmModeSetCrtc(screen.card.number(), before->crtc_id, before->buffer_id, before->x, before->y,
                   &screen.connector, 1, before->mode_valid != 0 ? &before->mode : nullptr);
  for (gbm_bo* buffer : {shown, queued})
    if (buffer != nullptr) gbm_surface_release_buffer(surface.get(), buffer);
  context.reset();
}

// True when no flip is under way any more.
bool KmsDisplay::State::finish_flip() noexcept {
  if (queued == nullptr) return true;
  drmEventContext events{};
  events.version = 2;
  events.page_flip_handler = [](int, unsigned, unsigned, unsigned, void* is_done) {
    *static_cast<bool*>(is_done) = true;
  };
  while (!is_flip_done) {
    pollfd card{screen.card.number(), POLLIN, 0};
    const int ready = ::poll(&card, 1, kFlipTimeoutMs);
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0 || (card.revents & POLLIN) == 0 || drmHandleEvent(card.fd, &events) != 0) return false;
  }
  gbm_surface_release_buffer(surface.get(), shown);
  shown = queued;
  queued = nullptr;
  return true;
}

bool KmsDisplay::State::show(gbm_bo* buffer) noexcept {
  const std::uint32_t number = framebuffer_of(buffer);
  if (number == 0 || !finish_flip()) return false;
  if (shown == nullptr) {
    if (drmModeSetCrtc(screen.card.number(), screen.crtc, number, 0, 0, &screen.connector, 1, &screen.mode) !=
        0)
      return false;
    shown = buffer;
    return true;
  }
  is_flip_done = false;
  if (drmModePageFlip(screen.card.number(), screen.crtc, number, DRM_MODE_PAGE_FLIP_EVENT, &is_flip_done) !=
      0)
    return false;
  queued = buffer;
  return true;
}

rt::Result<KmsDisplay> KmsDisplay::create(DisplayFormat format, const KmsConfig& config) {
  auto screen = find_screen(config.device);
  if (!screen) return screen.error();
  auto state = std::make_unique<State>();
  state->screen = std::move(*screen);
  state->before.reset(drmModeGetCrtc(state->screen.card.number(), state->screen.crtc));
  state->device.reset(gbm_create_device(state->screen.card.number()));
  const auto unavailable = [](const char* what) {
    return rt::Error{rt::ExitCode::device_unavailable, std::string("no screen can be driven: ") + what +
                                                           "; run with a window or without a display."};
  };
  if (state->device == nullptr) return unavailable("libgbm does not know this graphics card");
  auto context = Context::create_gbm(state->device.get(), GBM_FORMAT_XRGB8888, config.context);
  if (!context) return context.error();
  state->context = std::move(*context);
  const DisplayFormat size = state->screen_size();
  state->surface.reset(gbm_surface_create(state->device.get(), static_cast<std::uint32_t>(size.width_px),
                                          static_cast<std::uint32_t>(size.height_px),
                                          static_cast<std::uint32_t>(state->context->visual()),
                                          GBM_BO_USE_SCANOUT | GBM_BO_USE_RENDERING));
  if (state->surface == nullptr) return unavailable("libgbm has no buffers of the screen's size");
  const auto attached = state->context->attach(state->surface.get());
  if (!attached) return attached.error();
  const auto framebuffer = Framebuffer::create(format, *state->context);
  if (!framebuffer) return framebuffer.error();
  state->framebuffer = *framebuffer;
  if (drmSetMaster(state->screen.card.number()) != 0)
    return unavailable("another program, such as a desktop, has the screen");
  return KmsDisplay(std::move(state));
}

KmsDisplay::KmsDisplay(std::unique_ptr<State> state) : state_(std::move(state)) {}
KmsDisplay::KmsDisplay(KmsDisplay&&) noexcept = default;
KmsDisplay::~KmsDisplay() = default;

DisplayFormat KmsDisplay::format() const { return state_->framebuffer->format(); }
std::uint64_t KmsDisplay::frames_presented() const { return state_->frames_presented; }

rt::Status KmsDisplay::begin() noexcept {
  const rt::Status status = state_->context->make_current();
  if (status == rt::Status::ok) state_->framebuffer->bind();
  return status;
}

rt::Status KmsDisplay::present() noexcept {
  // A flip that never ended would leave EGL without a free buffer, and swap would wait for one.
  if (gbm_surface_has_free_buffers(state_->surface.get()) == 0 && !state_->finish_flip())
    return rt::Status::device_lost;
  state_->framebuffer->show(state_->screen_size());
  const rt::Status swapped = state_->context->swap();
  state_->framebuffer->bind();
  if (swapped != rt::Status::ok) return swapped;
  gbm_bo* buffer = gbm_surface_lock_front_buffer(state_->surface.get());
  if (buffer == nullptr) return rt::Status::device_lost;
  if (!state_->show(buffer)) {
    gbm_surface_release_buffer(state_->surface.get(), buffer);
    return rt::Status::device_lost;
  }
  ++state_->frames_presented;
  return rt::Status::ok;
}

void KmsDisplay::release() noexcept { state_->context->release(); }

}  // namespace tactus::hal::egl
