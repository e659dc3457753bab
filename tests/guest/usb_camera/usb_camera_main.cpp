// guest_usb_camera CLIP: plugs a USB camera that shows CLIP into this machine, until it is told to end (SIGTERM, SIGINT).
// SIGUSR1 pulls it out, SIGUSR2 plugs it in again. --help names the rest.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <limits>
#include <optional>
#include <string>

#include "rt/clock.hpp"
#include "tests/guest/usb_camera/usb_camera.hpp"

namespace {

using namespace tactus;
using namespace tactus::guest;
using namespace tactus::rt::literals;

struct Settings {
  std::string clip, streams = "both", name = "tactus camera", serial_number = "1", log;
  std::vector<double> frame_rates_hz{30};
  int port = 0;
  PlayOptions play;
  std::optional<double> plug_again_s;
};

int parse(int argc, char** argv, Settings& s) {
  CLI::App app("A USB camera in user space; needs the module vhci-hcd and root.");
  app.add_option("CLIP", s.clip, "Frames, as guest_render_clip leaves them")->required();
  app.add_option("--streams", s.streams, "What the camera has")->check(CLI::IsMember({"both", "depth", "color"}));
  app.add_option("--rates", s.frame_rates_hz, "Frames a second that it offers, its default first")->delimiter(',');
  app.add_option("--name", s.name, "What it calls itself");
  app.add_option("--serial", s.serial_number, "Its serial number");
  app.add_option("--port", s.port, "Where it is plugged in")->check(CLI::Range(0, 7));
  app.add_option("--log", s.log, "File that receives a line for every frame shown: its number and the monotonic time in s");
  app.add_flag("--once{false}", s.play.repeats, "Goes dark after the clip's last frame");
  app.add_option("--short-at", s.play.short_at, "This frame ends in its middle");
  app.add_option("--error-at", s.play.error_at, "This frame is marked as broken");
  app.add_option("--unplug-at", s.play.unplug_at, "In the middle of this frame the camera is pulled out");
  app.add_option("--plug-again", s.plug_again_s, "So many seconds later it is plugged in again");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  }
  return -1;
}

CameraSpec spec_of(const Settings& s, const Clip& clip) {
  CameraSpec camera{s.name, s.serial_number, {}, {}};
  if (s.streams != "color") camera.streams.push_back({hal::PixelFormat::depth16, clip.width(), clip.height()});
  if (s.streams != "depth") camera.streams.push_back({hal::PixelFormat::yuyv, clip.width(), clip.height()});
  for (const double rate_hz : s.frame_rates_hz)
    camera.frame_intervals.push_back(static_cast<std::uint32_t>(1e7 / rate_hz + 0.5));
  return camera;
}

void write_log(std::FILE* log, const std::vector<ShownFrame>& frames) {
  if (log == nullptr) return;
  for (const ShownFrame& shown : frames) std::fprintf(log, "%zu %.9f\n", shown.frame, shown.time.seconds());
  std::fflush(log);
}

rt::Result<void> play(const Settings& s, const sigset_t& signals) {
  auto clip = Clip::read(s.clip);
  if (!clip) return clip.error();
  std::FILE* log = s.log.empty() ? nullptr : std::fopen(s.log.c_str(), "w");
  if (log == nullptr && !s.log.empty()) return rt::Error{rt::ExitCode::failed, s.log + " cannot be written."};
  const CameraSpec spec = spec_of(s, *clip);
  UsbCamera camera(spec, std::make_shared<const Clip>(std::move(*clip)), s.port);
  const rt::Clock clock = rt::Clock::monotonic();
  auto plugged = camera.plug(s.play);
  constexpr rt::HostTime kNotPlanned{std::numeric_limits<std::int64_t>::max()};
  rt::HostTime plug_at = kNotPlanned;
  bool was_plugged = true, ends = false;
  PlayOptions later = s.play;
  later.unplug_at = kNever;
  while (plugged && !ends) {
    const timespec turn{0, 20'000'000};
    const int signal = sigtimedwait(&signals, nullptr, &turn);
    write_log(log, camera.take_shown());
    ends = signal == SIGTERM || signal == SIGINT;
    if (signal == SIGUSR1) camera.unplug();
    if (was_plugged && !camera.is_plugged() && s.plug_again_s)
      plug_at = clock.now() + rt::Duration{static_cast<std::int64_t>(*s.plug_again_s * 1e9)};
    was_plugged = camera.is_plugged();
    if (signal == SIGUSR2 || clock.now() >= plug_at) {
      plug_at = kNotPlanned;
      plugged = camera.plug(later);
    }
  }
  camera.unplug();
  write_log(log, camera.take_shown());
  if (log != nullptr) std::fclose(log);
  return plugged;
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  if (const int code = parse(argc, argv, settings); code >= 0) return code;
  // Blocked before the camera's thread is there, so that they wait for sigtimedwait.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1, SIGUSR2}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  const auto played = play(settings, signals);
  if (played) return 0;
  std::fprintf(stderr, "%s\n", played.error().message.c_str());
  return static_cast<int>(played.error().code);
}
