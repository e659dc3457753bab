#include "tests/firmware_host/sample_run.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace tactus::firmware::test {
namespace {

constexpr int kFrames = 300, kLostFrom = 141, kLostUntil = 146;
constexpr double kTurn = 2 * std::numbers::pi;

std::vector<float> series(std::mt19937& random, double median_ms, double spread, double spike_share,
                          double spike_ms, int every = 1) {
  std::lognormal_distribution<double> usual(std::log(median_ms), spread);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<float> values;
  for (int i = 0; i < kFrames; ++i) {
    const bool has_spike = unit(random) < spike_share;
    const double v = usual(random) + (has_spike ? spike_ms * unit(random) : 0);
    values.push_back(i % every == 0 ? static_cast<float>(v) : kDidNotRun);
  }
  return values;
}

T_WorldDepth pose(double t) {  // t in turns of the loop
  const double a = kTurn * t;
  const Vec3d position{0.62 * std::sin(a) + 0.01 * std::sin(23 * a),
                       0.09 * std::sin(2 * a + 0.4) + 0.006 * std::sin(31 * a),
                       -0.34 * (1 - std::cos(a)) + 0.12 * std::sin(2 * a)};
  const double yaw = 0.35 * std::sin(a) + 0.25, pitch = -0.15 + 0.1 * std::cos(a);
  // Optical frame: x right, y down, z forward; the camera looks along -z of the world at yaw 0.
  const Quaternion turn{std::cos(yaw / 2), 0, std::sin(yaw / 2), 0};
  const Quaternion tilt{std::cos(pitch / 2), std::sin(pitch / 2), 0, 0};
  return {Rotation::from((turn * tilt * Quaternion{0, 1, 0, 0}).normalized()), position};
}

Picture room_picture(const std::string& title, const std::string& caption, bool is_labelled) {
  Picture p;
  p.title = title;
  p.caption = caption;
  p.width = 640;
  p.height = 400;
  for (int y = 0; y < p.height; ++y) {
    for (int x = 0; x < p.width; ++x) {
      const double u = (x - 320) / 320.0, v = (y - 170) / 200.0;
      const bool is_floor = v > 0.35 + 0.08 * std::abs(u), is_bed = u > 0.1 && v > 0.12 && v < 0.75 - 0.2 * u;
      const double bx = x - 262, by = y - 268, ball = bx * bx + by * by;
      double r = 196, g = 190, b = 178;
      Rgb8 label = material_color(12);
      if (is_floor) r = 150 + 20 * std::sin(x * 0.13), g = r * 0.72, b = r * 0.5, label = material_color(22);
      if (is_bed) r = 92, g = 108, b = 150, label = material_color(3);
      const double shade = 0.85 + 0.2 * std::cos(u) - 0.15 * v;
      r *= shade, g *= shade, b *= shade;
      if (is_labelled) r = 0.4 * r + 0.6 * label.r, g = 0.4 * g + 0.6 * label.g, b = 0.4 * b + 0.6 * label.b;
      if (ball < 34 * 34 && !is_bed) {
        const double light = std::max(0.15, 1 - ((bx + 12) * (bx + 12) + (by + 14) * (by + 14)) / 2400);
        r = 235 * light, g = 96 * light, b = 52 * light;
      }
      for (const double c : {r, g, b})
        p.rgb.push_back(static_cast<std::uint8_t>(std::min(255.0, std::max(0.0, c))));
    }
  }
  return p;
}

}  // namespace

RunResult sample_run() {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.0004);
  RunResult r;
  r.source = "synthetic:bedroom?mode=640x480";
  r.description = "Synthetic room 'bedroom', Kinect-like noise, seed 1, 300 frames";
  r.runner = "lockstep";
  r.profile = "x86";
  r.app = "shooting";
  r.collision = "semantic";
  r.command = "tactus run synthetic:bedroom --out out --app shooting --collision semantic";
  r.date = "2026-11-22 14:03 UTC";
  r.revision = "0.1.0 (05f9eab1c2d3)";
  r.machine = {"Example CPU @ 2.40GHz", 2, 8'323'000'000, "Linux 6.1.0-18-amd64 x86_64", "gcc 12.2.0"};
  r.threads_count = 2;
  r.width = 640;
  r.height = 480;
  r.frame_rate_hz = 30;
  r.wall_s = 4.21;
  r.gravity_origin = "from the sensor";
  r.frames = {kFrames, kFrames - (kLostUntil - kLostFrom), 0, kLostUntil - kLostFrom, 0};
  r.keyframes = 25;
  r.relocalisations = 1;

  struct Row {
    const char *name, *thread;
    double median_ms, spread, budget_ms;
    int every;
  };
  for (const Row& row :
       {Row{"register", "spine", 0.62, 0.06, 1.5, 1}, Row{"track", "spine", 2.1, 0.14, 5, 1},
        Row{"integrate", "spine", 2.4, 0.10, 4, 1}, Row{"predict", "spine", 1.3, 0.12, 1.6, 1},
        Row{"fuse", "spine", 0.8, 0.2, 2, 12}, Row{"refine", "refine", 3.1, 0.25, 5, 1},
        Row{"segment", "segment", 9.4, 0.08, 60, 12}, Row{"contact", "present", 0.21, 0.4, 2, 1}}) {
    StageResult s;
    s.name = row.name;
    s.thread = row.thread;
    s.frame_ms = series(random, row.median_ms, row.spread, 0.012, 3 * row.median_ms, row.every);
    s.latency_ms = summarise_latency(s.frame_ms);
    s.budget_p99_ms = row.budget_ms;
    s.budget_max_ms = 2 * row.budget_ms;
    s.late_count = s.name == "predict" ? 3 : 0;
    r.stages.push_back(std::move(s));
  }
  r.frame_ms = series(random, 6.5, 0.07, 0.015, 9);
  r.frame_ms[212] = 41;
  r.frame_latency_ms = summarise_latency(r.frame_ms);
  r.frame_budget_ms = 12;

  r.memory = {
      {"depth frames", "hal", "driver 2 + track 1 + segment 1 + burst 1, 640x480 uint16", 3'072'000,
       1'843'200, false},
      {"colour frames", "hal", "driver 2 + segment 1 + burst 1, 640x480x3", 3'686'400, 2'764'800, false},
      {"map blocks", "map", "blocks of 8x8x8 voxels at 4.9 bytes each", 41'943'040, 18'233'344, false},
      {"map hash", "map", "2 slots per block", 2'097'152, 911'360, false},
      {"pyramids", "track", "3 levels x (vertices + normals) x (frame, model)", 9'830'400, 9'830'400, false},
      {"keyframe store", "track", "64 relocalisation keyframes of 80x60", 614'400, 240'000, false},
      {"ode pool", "contact", "fenced: bodies, geoms and joints of 64 spheres", 1'048'576, 322'112, false},
      {"stacks", "rt", "4 threads x 256 KiB", 1'048'576, std::nullopt, false},
      {"EGL driver", "render", "cannot be fenced in: measured", 58'720'256, 58'720'256, true}};
  r.resident_bytes_peak = 171'000'000;
  r.memory_was_locked = true;
  r.map = {7122, 16384, 0, 4.9, 0.01, 0.04, 412'033, 801'992};
  r.labels.model = "deeplabv3_mnv2_ade20k_int8.tflite";
  r.labels.keyframes_segmented = 24;
  r.labels.keyframes_replaced = 1;
  r.labels.age_ms_p50 = 14.2;
  r.labels.surface = {{22, 0.34, 0.81},
                      {3, 0.27, 0.77},
                      {12, 0.19, 0.69},
                      {1, 0.06, 0.72},
                      {6, 0.011, 0.55},
                      {9, 0.0004, 0.41},
                      {kUnknownMaterial, 0.1286, 0}};
  r.map_hash = 0x8f3a11c20b77e5d4;
  r.geometry_hash = 0x1f0e5599aa01c3b7;
  r.label_hash = 0x00c0ffee12345678;

  for (int i = 0; i < kFrames; ++i) {
    const rt::SensorTime time{1'000'000'000 + i * 33'333'333LL};
    const T_WorldDepth T = pose(1.0 * i / kFrames);
    r.truth.push_back({time, T});
    if (i >= kLostFrom && i < kLostUntil) continue;
    T_WorldDepth estimate = T;
    estimate.translation +=
        Vec3d{noise(random) + 0.002 * std::sin(i * 0.02), noise(random), noise(random) + 1e-5 * i};
    r.trajectory.push_back({time, estimate});
  }
  r.accuracy = *evaluate::evaluate_trajectory(r.trajectory, r.truth);
  r.surface_error_mean_m = 0.00082;

  r.events = {{{1'400'000'000}, 12, "shot", "ball of 3 cm", std::nullopt, {{0.1, 0.2, -0.3}}, {}},
              {{1'900'000'000},
               27,
               "contact",
               "",
               3,
               {{0.62, -0.4, -1.2}},
               {{"speed_m_s", 4.1}, {"impulse_ns", 0.12}}},
              {{2'433'333'000},
               43,
               "contact",
               "",
               22,
               {{0.5, -0.9, -1.1}},
               {{"speed_m_s", 2.6}, {"impulse_ns", 0.08}}},
              {{5'700'000'000}, kLostFrom, "lost", "no pose explains the frame", std::nullopt, {}, {}},
              {{5'866'666'000},
               kLostUntil,
               "relocalised",
               "keyframe 9, 4.1 mm from its prediction",
               std::nullopt,
               {},
               {}},
              {{7'100'000'000}, 183, "break", "12 chips", 6, {{-0.9, 0.4, -2.0}}, {{"speed_m_s", 6.8}}}};
  r.pictures = {
      room_picture("A ball behind the bed", "Frame 43: the part behind the bed is hidden by its real depth.",
                   false),
      room_picture("Labels", "Most likely material per surface point, in the overlay colours.", true),
      room_picture("Map", "The map as ray-cast from the last pose.", false)};
  r.notes = {
      {Note::Kind::note, "Colour and depth are registered by the device; the register stage copies."},
      {Note::Kind::warning, "SCHED_FIFO was refused (no CAP_SYS_NICE): threads run at normal priority."}};
  return r;
}

}  // namespace tactus::firmware::test
