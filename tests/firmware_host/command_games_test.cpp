// The games as their user has them: the program plays in lockstep, what it leaves is read back.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstring>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "firmware_host/open_source.hpp"
#include "tests/firmware_host/program.hpp"
#include "tests/hal/movie/film_reader.hpp"

namespace tactus::firmware {
namespace {

using hal::testing::Film;
using hal::testing::read_film;
using nlohmann::json;
using test::events_of;
using test::run_tactus;

constexpr const char* kSource = "synthetic:bedroom?mode=320x240";
constexpr int kFrames = 60, kWidth = 320, kHeight = 240;
constexpr double kRateHz = 30, kSampleRateHz = 48000;
constexpr double kSoundMetresPerSecond = 343;

/// A plate at the bed, one at the wood beside it.
constexpr const char* kPlates = R"(
[[throw]]
at_frame = 20
thing = "plate"
aim_px = [60, 190]
[[throw]]
at_frame = 32
thing = "plate"
aim_px = [140, 160]
)";

/// A slow ball near the eye.
constexpr const char* kBall = R"(
[[throw]]
at_frame = 20
shape = "sphere"
radius_m = 0.08
material = "plastic"
in_front_m = 0.8
)";

constexpr const char* kNothing = R"(
[[throw]]
at_frame = 100000
shape = "sphere"
)";

/// Wood on the left, brick on the right, 0.6 s apart.
constexpr const char* kShots = R"(
[[shot]]
at_frame = 32
aim_px = [20, 120]
[[shot]]
at_frame = 51
aim_px = [240, 190]
)";

class Games : public ::testing::Test {
 protected:
  /// The folder of a run that ended with exit code 0.
  std::filesystem::path played(const std::string& name, const char* app, const char* script,
                               const std::vector<std::string>& more = {}, int frames = kFrames) {
    const std::filesystem::path out = folder_.path() / name;
    const std::string file = folder_.write(name + ".toml", script).string();
    std::vector<std::string> words = {"run",   kSource, "--runner", "lockstep", "--frames", ":" + std::to_string(frames),
                                      "--app", app,     "--script", file,       "--out",    out.string()};
    words.insert(words.end(), more.begin(), more.end());
    const test::Outcome o = run_tactus(words);
    EXPECT_EQ(o.code, 0) << o.err;
    return out;
  }

  test::TemporaryFolder folder_;
};

struct Sound {
  std::array<std::vector<float>, 2> ears;
  [[nodiscard]] std::size_t size() const { return ears[0].size(); }
};

/// 16-bit stereo at 48 kHz; the header's length comes from its "data" word.
Sound read_wav(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const std::size_t data = bytes.find("data");
  Sound sound;
  if (bytes.size() < 44 || data == std::string::npos) return sound;
  std::uint16_t channels = 0, bits = 0;
  std::uint32_t rate = 0;
  std::memcpy(&channels, &bytes[22], 2);
  std::memcpy(&rate, &bytes[24], 4);
  std::memcpy(&bits, &bytes[34], 2);
  EXPECT_EQ(channels, 2);
  EXPECT_EQ(rate, 48000u);
  EXPECT_EQ(bits, 16);
  for (std::size_t at = data + 8; at + 4 <= bytes.size(); at += 4)
    for (std::size_t ear = 0; ear < 2; ++ear) {
      std::int16_t sample = 0;
      std::memcpy(&sample, &bytes[at + 2 * ear], 2);
      sound.ears[ear].push_back(static_cast<float>(sample) / 32768.0f);
    }
  return sound;
}

double energy(const std::vector<float>& samples, double from_s, double until_s) {
  double sum = 0;
  const auto end = std::min(samples.size(), static_cast<std::size_t>(until_s * kSampleRateHz));
  for (auto i = static_cast<std::size_t>(from_s * kSampleRateHz); i < end; ++i)
    sum += static_cast<double>(samples[i]) * static_cast<double>(samples[i]);
  return sum;
}

/// Mean frequency of a piece, weighted by power: 2048 samples, direct transform.
double spectral_centroid_hz(const std::vector<float>& samples, double from_s) {
  constexpr int kSamples = 2048;
  const auto begin = static_cast<std::size_t>(from_s * kSampleRateHz);
  double power_sum = 0, weighted = 0;
  for (int k = 1; k < kSamples / 2; ++k) {
    std::complex<double> sum;
    for (int i = 0; i < kSamples; ++i)
      sum += static_cast<double>(samples[begin + static_cast<std::size_t>(i)]) *
             std::polar(1.0, -2 * std::numbers::pi * k * i / kSamples);
    power_sum += std::norm(sum);
    weighted += std::norm(sum) * k * kSampleRateHz / kSamples;
  }
  return weighted / power_sum;
}

/// Where the camera was, frame by frame.
std::vector<T_WorldDepth> poses_of(const std::filesystem::path& folder) {
  std::ifstream file(folder / "trajectory.txt");
  std::vector<T_WorldDepth> poses;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    double time = 0;
    Vec3d t;
    Quaternion q;
    words >> time >> t.x >> t.y >> t.z >> q.x >> q.y >> q.z >> q.w;
    poses.push_back({Rotation::from(q), t});
  }
  return poses;
}

Vec3d position_of(const json& event) {
  const json& p = event["position_world_m"];
  return {p[0].get<double>(), p[1].get<double>(), p[2].get<double>()};
}
Vec3d in_camera(const T_WorldDepth& T_world_camera, const Vec3d& p_world) {
  return T_world_camera.rotation.transposed() * (p_world - T_world_camera.translation);
}

int largest_difference(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b, std::size_t pixel) {
  int largest = 0;
  for (std::size_t c = 0; c < 3; ++c) largest = std::max(largest, std::abs(int{a[3 * pixel + c]} - int{b[3 * pixel + c]}));
  return largest;
}

void expect_film_and_sound_of_the_session(const std::filesystem::path& out) {
  const Film film = read_film(out / "video.mp4");
  EXPECT_EQ(film.width_px, kWidth);
  EXPECT_EQ(film.height_px, kHeight);
  ASSERT_EQ(film.pictures.size(), static_cast<std::size_t>(kFrames));
  for (std::size_t i = 0; i < film.pictures.size(); ++i)
    EXPECT_NEAR(film.pictures[i].time_s, static_cast<double>(i) / kRateHz, 1e-3);
  EXPECT_NEAR(film.picture_duration_s, kFrames / kRateHz, 1 / kRateHz);
  EXPECT_NEAR(film.sound_duration_s, kFrames / kRateHz, 1 / kRateHz);
  const Sound sound = read_wav(out / "sound.wav");
  EXPECT_NEAR(static_cast<double>(sound.size()) / kSampleRateHz, kFrames / kRateHz, 1 / kRateHz);
}

/// The summary's part that every game has.
json expect_summary_of_the_session(const std::filesystem::path& out) {
  json s = test::summary_of(out);
  EXPECT_EQ(s["heap_allocations_after_seal"], 0);
  EXPECT_EQ(s["frames_in"], kFrames);
  EXPECT_EQ(s["display"]["pictures_recorded"], kFrames);
  const json& photon = s["display"]["camera_to_photon_ms"];
  EXPECT_EQ(photon["count"], kFrames);  // those of the report are not shown to anybody
  EXPECT_GT(photon["mean"].get<double>(), 0);
  EXPECT_LT(photon["mean"].get<double>(), photon["max"].get<double>());
  for (const auto& [name, stage] : s["stage_latency_ms"].items())
    EXPECT_EQ(stage["mean"].get<double>() > 0, stage["count"].get<int>() > 0) << name;
  EXPECT_EQ(s["events"], events_of(out).size());
  return s;
}

void expect_events_of_plates(const std::filesystem::path& out) {
  const auto throws = events_of(out, {"throw"});
  ASSERT_EQ(throws.size(), 2u);
  for (const json& thrown : throws) {
    EXPECT_EQ(thrown["body_material"], "ceramic");
    for (const char* field : {"time_s", "frame", "order", "body", "speed_m_per_s", "position_world_m"})
      EXPECT_TRUE(thrown.contains(field)) << field;
  }
  ASSERT_FALSE(events_of(out, {"break"}).empty());
  for (const json& event : events_of(out, {"contact", "break"})) {
    for (const char* field : {"order", "body", "material", "body_material", "outcome", "probability", "impulse_n_s",
                              "impact_speed_m_per_s", "energy_j"})
      EXPECT_TRUE(event.contains(field)) << field << " in " << event;
    EXPECT_GE(event["probability"].get<double>(), 0);
    EXPECT_LE(event["probability"].get<double>(), 1);
  }
}

void expect_first_sound_within_a_frame_of_its_impact(const std::filesystem::path& out) {
  const auto contacts = events_of(out, {"contact", "break"});
  ASSERT_FALSE(contacts.empty());
  const auto frame = contacts[0]["frame"].get<std::size_t>();
  const double distance_m = in_camera(poses_of(out)[frame], position_of(contacts[0])).norm();
  const Sound sound = read_wav(out / "sound.wav");
  std::size_t first = 0;
  while (first < sound.size() && std::fabs(sound.ears[0][first]) < 1e-3f && std::fabs(sound.ears[1][first]) < 1e-3f) ++first;
  const double heard_s = static_cast<double>(first) / kSampleRateHz, seen_s = static_cast<double>(frame) / kRateHz;
  EXPECT_GE(heard_s, seen_s - 1 / kRateHz);
  EXPECT_LE(heard_s, seen_s + 1 / kRateHz + distance_m / kSoundMetresPerSecond + 1e-3);
}

void expect_same_bits(const std::filesystem::path& first, const std::filesystem::path& second) {
  const auto bytes_of = [](const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  };
  EXPECT_EQ(bytes_of(first / "events.jsonl"), bytes_of(second / "events.jsonl"));
  EXPECT_TRUE(bytes_of(first / "sound.wav") == bytes_of(second / "sound.wav"));
  const Film a = read_film(first / "video.mp4"), b = read_film(second / "video.mp4");
  ASSERT_EQ(a.pictures.size(), b.pictures.size());
  for (std::size_t i = 0; i < a.pictures.size(); ++i) EXPECT_TRUE(a.pictures[i].rgb == b.pictures[i].rgb) << i;
  EXPECT_TRUE(a.sound == b.sound);
}

TEST_F(Games, PlatesLeaveFilmSoundAndEventsThatBelongTogetherAndTheSameBitsTwice) {
  const auto out = played("plates", "plates", kPlates);
  expect_film_and_sound_of_the_session(out);
  expect_events_of_plates(out);
  expect_first_sound_within_a_frame_of_its_impact(out);
  const json summary = expect_summary_of_the_session(out);
  EXPECT_EQ(summary["app"], "plates");
  EXPECT_EQ(summary["game"]["throws"], 2);
  EXPECT_EQ(summary["game"]["broken"], events_of(out, {"break"}).size());
  expect_same_bits(out, played("again", "plates", kPlates));
}

TEST_F(Games, ShotsAreLouderOnTheirSideAndTheirMaterialsSoundDifferent) {
  const auto out = played("shots", "shooting", kShots);
  expect_film_and_sound_of_the_session(out);
  const json summary = expect_summary_of_the_session(out);
  EXPECT_EQ(summary["game"]["shots"], 2);
  EXPECT_EQ(summary["game"]["marks"], 2);
  ASSERT_EQ(events_of(out, {"shot"}).size(), 2u);
  const auto hits = events_of(out, {"hit"});
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_EQ(hits[0]["material"], "wood");
  EXPECT_EQ(hits[1]["material"], "brick");
  const std::vector<T_WorldDepth> poses = poses_of(out);
  const Sound sound = read_wav(out / "sound.wav");
  std::array<double, 2> centroid_hz{};
  for (std::size_t i = 0; i < 2; ++i) {
    const json& hit = hits[i];
    EXPECT_GT(hit["probability"].get<double>(), 0.5);
    EXPECT_EQ(hit["energy_j"].get<double>(), 60);
    EXPECT_TRUE(hit.contains("mark")) << hit;
    EXPECT_GT(hit["chips"].get<int>(), 0);
    EXPECT_GT(hit["chips_mass_kg"].get<double>(), 0);
    EXPECT_GT(hit["chips_speed_m_per_s"].get<double>(), 0);
    const auto frame = hit["frame"].get<std::size_t>();
    const Vec3d p = in_camera(poses[frame], position_of(hit));
    EXPECT_EQ(p.x < 0, i == 0) << "the first is meant to be on the left";
    const double begin_s = static_cast<double>(frame) / kRateHz + p.norm() / kSoundMetresPerSecond;
    const double left = energy(sound.ears[0], begin_s, begin_s + 0.1), right = energy(sound.ears[1], begin_s, begin_s + 0.1);
    EXPECT_GT(i == 0 ? left / right : right / left, 1.2) << hit;
    centroid_hz[i] = spectral_centroid_hz(sound.ears[i], begin_s);
  }
  EXPECT_GT(std::max(centroid_hz[0], centroid_hz[1]) / std::min(centroid_hz[0], centroid_hz[1]), 1.3)
      << centroid_hz[0] << " Hz of wood, " << centroid_hz[1] << " Hz of brick";
}

TEST_F(Games, ThrownBallIsSeenWhereItIs) {
  const auto out = played("ball", "plates", kBall, {}, 24), empty = played("nothing", "plates", kNothing, {}, 24);
  const auto throws = events_of(out, {"throw"});
  ASSERT_EQ(throws.size(), 1u);
  EXPECT_TRUE(events_of(empty).empty());
  const auto frame = throws[0]["frame"].get<std::size_t>();
  const auto sensor = open_source(kSource);
  ASSERT_TRUE(sensor);
  const hal::Intrinsics& camera = sensor->calibration.color;
  const Vec3d p = in_camera(poses_of(out)[frame], position_of(throws[0]));
  const double u = camera.fx * p.x / p.z + camera.cx, v = camera.fy * p.y / p.z + camera.cy, radius = camera.fx * 0.08 / p.z;
  const Film with = read_film(out / "video.mp4"), without = read_film(empty / "video.mp4");
  ASSERT_GT(with.pictures.size(), frame);
  ASSERT_GT(without.pictures.size(), frame);
  int inside = 0, inside_changed = 0, outside = 0, outside_changed = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double distance = std::hypot(x - u, y - v);
      const bool has_changed = largest_difference(with.pictures[frame].rgb, without.pictures[frame].rgb,
                                                  static_cast<std::size_t>(y * kWidth + x)) > 24;
      if (distance < 0.85 * radius) {
        ++inside;
        inside_changed += has_changed ? 1 : 0;
      } else if (distance > 1.2 * radius) {
        ++outside;
        outside_changed += has_changed ? 1 : 0;
      }
    }
  ASSERT_GT(inside, 500);
  EXPECT_GT(inside_changed, inside * 8 / 10) << "of " << inside << " at " << u << ", " << v << ", radius " << radius;
  EXPECT_LT(outside_changed, outside / 20) << "of " << outside << "; its shadow alone is there";
  // Until then the films differ by what the encoder spends alone.
  for (std::size_t i = 0; i < frame; ++i) {
    int changed = 0;
    for (std::size_t pixel = 0; pixel < std::size_t{kWidth} * kHeight; ++pixel)
      changed += largest_difference(with.pictures[i].rgb, without.pictures[i].rgb, pixel) > 24 ? 1 : 0;
    EXPECT_LT(changed, kWidth * kHeight / 500) << i;
  }
}

TEST_F(Games, ConditionsOfTheStudyDifferAsTheyShould) {
  const auto none = played("none", "plates", kPlates, {"--collision", "none"});
  EXPECT_EQ(events_of(none, {"throw"}).size(), 2u);
  EXPECT_TRUE(events_of(none, {"contact", "break", "hit"}).empty());

  const auto broken = [](const std::filesystem::path& run, int order) {
    for (const json& event : events_of(run, {"break"}))
      if (event["order"] == order) return true;
    return false;
  };
  const auto uniform = played("uniform", "plates", kPlates, {"--collision", "uniform"});
  for (const json& event : events_of(uniform, {"contact", "break"})) EXPECT_EQ(event["material"], "unknown");
  EXPECT_TRUE(broken(uniform, 0)) << "on the bed, which nobody knows to be soft";
  EXPECT_TRUE(broken(uniform, 1));

  const auto semantic = played("semantic", "plates", kPlates);
  const auto first = events_of(semantic, {"contact"});
  ASSERT_FALSE(first.empty());
  EXPECT_EQ(first[0]["order"], 0);
  EXPECT_EQ(first[0]["material"], "fabric");
  EXPECT_FALSE(broken(semantic, 0)) << "on the bed";
  EXPECT_TRUE(broken(semantic, 1)) << "on wood";
}

TEST_F(Games, SourceWithoutColourIsPlayedOnBlack) {
  const std::filesystem::path room = folder_.path() / "room";
  ASSERT_EQ(run_tactus({"convert", std::string(kSource) + "&frames=24", room.string()}).code, 0);
  std::filesystem::remove_all(room / "rgb");
  std::filesystem::remove(room / "rgb.txt");
  const auto out = folder_.path() / "black", script = folder_.write("black.toml", kBall);
  const test::Outcome o = run_tactus({"run", room.string(), "--runner", "lockstep", "--app", "plates", "--script",
                                      script.string(), "--out", out.string()});
  ASSERT_EQ(o.code, 0) << o.err;
  const Film film = read_film(out / "video.mp4");
  ASSERT_EQ(film.pictures.size(), 24u);
  const auto bright = [](const hal::testing::FilmPicture& picture) {
    return std::count_if(picture.rgb.begin(), picture.rgb.end(), [](std::uint8_t value) { return value > 24; });
  };
  EXPECT_EQ(bright(film.pictures[10]), 0);
  EXPECT_GT(bright(film.pictures[20]), 500);
}

TEST_F(Games, FullDiskCostsWhatDoesNotFitAndNothingElse) {
  const auto out = folder_.path() / "full", script = folder_.write("full.toml", kPlates);
  constexpr std::uint64_t kBytesMax = 150'000;  // the film needs twice that, the sound more
  const test::Outcome o = run_tactus({"run", kSource, "--runner", "lockstep", "--frames", ":40", "--app", "plates",
                                      "--script", script.string(), "--out", out.string()},
                                     {.environment = {}, .without = {}, .file_bytes_max = kBytesMax});
  EXPECT_EQ(o.code, 1);
  EXPECT_NE(o.err.find("is the disk full?"), std::string::npos) << o.err;
  EXPECT_EQ(o.out, "");
  const json summary = test::summary_of(out);
  ASSERT_FALSE(summary.is_discarded());
  EXPECT_EQ(summary["frames_in"], 40);
  EXPECT_TRUE(test::is_noted(summary, "sound.wav") || test::is_noted(summary, "video.mp4")) << summary["notes"];
  EXPECT_EQ(poses_of(out).size(), 40u);
  EXPECT_EQ(events_of(out, {"throw"}).size(), 2u);
}

}  // namespace
}  // namespace tactus::firmware
