// Everything a run yields, as plain values. The runner fills it; the writers of summary.json, trace.json,
// report.html and the other outputs only read it.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware_host/machine.hpp"
#include "pipeline/capture/intake.hpp"
#include "pipeline/capture/pairing.hpp"
#include "pipeline/evaluate/overlay.hpp"
#include "pipeline/evaluate/trajectory.hpp"
#include "pipeline/label/material.hpp"
#include "pipeline/map/refine_labels.hpp"

namespace tactus::firmware {

/// Milliseconds; all zero when nothing was measured.
struct LatencySummary {
  double p50 = 0, p99 = 0, max = 0, mean = 0;
  std::uint64_t count = 0;
};

/// Nearest-rank percentiles of a series; NaN entries (the stage did not run in that frame) are left out.
LatencySummary summarise_latency(std::span<const float> series_ms);

/// The value of a frame in which a stage did not run.
inline constexpr float kDidNotRun = std::numeric_limits<float>::quiet_NaN();

struct StageResult {
  std::string name;  // as in the budgets
  std::string thread;
  LatencySummary latency_ms;
  double budget_p99_ms = 0;         // 0: none
  double budget_max_ms = 0;         // 0: none
  std::uint64_t skipped_count = 0;  // by policy
  std::uint64_t late_count = 0;     // past its deadline
  std::vector<float> frame_ms;      // one value per frame in order, kDidNotRun where it did not; may be empty
};

struct MemoryResult {
  std::string name, owner, why;
  std::uint64_t planned_bytes = 0;
  std::optional<std::uint64_t> high_water_bytes;  // unknown for owners without a counter
  bool is_outside_arena = false;                  // a guest that cannot be fenced in: measured, not planned
};

struct MapResult {
  std::uint64_t blocks_used = 0, blocks_capacity = 0, evicted = 0;
  double bytes_per_voxel = 0, voxel_size_m = 0, truncation_m = 0;
  std::uint64_t mesh_vertices = 0, mesh_triangles = 0;
};

/// How much of the mapped surface carries this label.
struct LabelResult {
  MaterialId material = kUnknownMaterial;
  double surface_share = 0;     // 0..1 of the mapped surface
  double mean_probability = 0;  // of the winner, where it wins
};

struct LabelingResult {
  std::string model;  // file of the network; empty: none ran
  std::uint64_t keyframes_segmented = 0;
  std::uint64_t keyframes_replaced = 0;  // came while the network was busy and were overtaken by a later one
  double age_ms_p50 = 0;                 // keyframe taken to label in the map
  map::RefineCounters refined;           // all 0 when the CRF did not run
  std::vector<LabelResult> surface;      // materials that occur, unknown included
};

struct Picture {
  std::string title, caption;
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // row-major, 3 bytes a pixel
};

/// Something that happened at a moment: "contact", "break", "sound", "lost", "relocalised", "evicted" ...
struct RunEvent {
  rt::SensorTime time;
  std::uint64_t frame = 0;
  std::string kind;
  std::string text;  // for people; may be empty
  std::optional<MaterialId> material;  // of what was touched; unset: nothing was
  std::optional<Vec3d> position_world_m;
  std::vector<std::pair<std::string, double>> values;  // further numbers, unit last in the name: "impulse_ns"
  std::optional<MaterialId> body_material = {};        // of the thing that touched it
  std::string outcome = {};                            // what people see of it; empty: nothing was touched
};

struct Note {
  enum class Kind : std::uint8_t { note, warning };
  Kind kind = Kind::note;
  std::string text;
};

/// What the games did.
struct GameResult {
  std::uint64_t throws = 0, shots = 0, misses = 0, broken = 0, chips = 0, marks = 0;
  std::uint64_t orders_refused = 0, events_dropped = 0;
  std::uint64_t walkers = 0, goals_reached = 0, stuck = 0;  // walkers that were put down; goals without a way
  double walked_m = 0;                                      // of all together
  std::uint64_t sounds = 0, reflections = 0, sounds_left_out = 0;
};

/// How the pictures fit the room. Predicted: one frame ahead, from the poses until then.
struct DisplayResult {
  std::uint64_t pictures_recorded = 0;  // in video.mp4
  std::string film, sound;              // files beside the report; empty: not written
  LatencySummary camera_to_photon_ms;   // count 0: nothing was drawn
  evaluate::OverlayError predicted_to_tracked, predicted_to_truth, tracked_to_truth;  // poses_count 0: unknown
};

/// in = tracked + dropped + lost + rejected.
struct FrameCounts {
  std::uint64_t in = 0;        // taken from the sensor
  std::uint64_t tracked = 0;   // with a trusted pose
  std::uint64_t dropped = 0;   // overtaken in a full ring
  std::uint64_t lost = 0;      // tracking had no trusted pose
  std::uint64_t rejected = 0;  // corrupt, of the wrong size, twice, out of order, with an impossible time
  std::uint64_t missing = 0;   // never came, by their numbers: not in `in`
};

/// What the cameras were like.
struct SensorResult {
  bool is_live = false;
  std::uint64_t losses = 0;     // times that a device went away
  std::uint64_t timeouts = 0;   // rounds without a frame
  std::uint64_t buffers_bytes = 0;
  IntakeCounts depth, color;
  std::uint64_t color_rejected = 0, color_missing = 0;
  std::uint64_t paired = 0, colors_unpaired = 0, depths_unpaired = 0;
  std::array<std::uint64_t, Pairing::kSkewBins> skew_ms_counts{};  // of the pairs, whole milliseconds from -20 on
  LatencySummary skew_ms;                                          // its size
  std::optional<double> depth_drift_ppm, color_drift_ppm;          // against this machine's clock, where both are known
  LatencySummary arrival_to_read_ms;                               // of live cameras
};

/// Of --faults, by kind: frames hit.
struct InjectedFault {
  std::string kind;
  std::uint64_t depth = 0, color = 0;
};

struct RecordedStream {
  std::uint64_t frames = 0, dropped = 0;
};

/// Of --record.
struct RecordingResult {
  std::string file;
  std::uint64_t file_bytes = 0;
  RecordedStream depth, color;
};

struct RunResult {
  // What ran.
  std::string source;       // as given on the command line
  std::string description;  // the sensor's own words
  std::string runner;       // "lockstep" or "realtime"
  std::string profile;
  std::string app = "none", collision = "none";
  std::string command;   // the whole command line
  std::string date;      // date_and_time_utc()
  std::string revision;  // revision()
  Machine machine;
  int threads_count = 0;
  int width = 0, height = 0;  // depth image, pixels
  double frame_rate_hz = 0;   // nominal
  double wall_s = 0;          // first frame in to last frame done
  std::string
      gravity_origin;  // where "up" comes from: sensor, recording, command line, largest level plane, none
  bool was_interrupted = false;  // SIGINT

  // What came of it.
  FrameCounts frames;
  SensorResult sensor;
  std::optional<RecordingResult> recording;
  std::optional<std::vector<InjectedFault>> faults;  // with --faults
  std::uint64_t keyframes = 0, relocalisations = 0;
  LatencySummary frame_latency_ms;
  std::vector<float> frame_ms;       // frame in to frame done, one value per frame
  double frame_budget_ms = 0;        // 0: none
  std::vector<StageResult> stages;   // in the order of the data flow
  std::vector<MemoryResult> memory;  // in table order
  std::uint64_t resident_bytes_peak = 0;
  std::uint64_t heap_allocations_after_seal = 0;
  std::uint64_t heap_allocations_in_guests = 0;  // by camera libraries and decoders, on our capture thread
  std::uint64_t heap_allocations_elsewhere = 0;  // by libraries' own threads, decoders ahead, recorder, film and present
  bool memory_was_locked = false;
  MapResult map;
  LabelingResult labels;
  std::uint64_t map_hash = 0, geometry_hash = 0, label_hash = 0;
  std::vector<evaluate::StampedPose> trajectory;       // tracked frames
  std::vector<evaluate::StampedPose> truth;            // empty: unknown
  std::optional<evaluate::TrajectoryReport> accuracy;  // with truth
  std::optional<double> surface_error_mean_m;          // where the source knows its surface
  std::vector<RunEvent> events;
  GameResult game;
  DisplayResult display;
  std::vector<Picture> pictures;  // the first one is shown large
  std::vector<Note> notes;

  [[nodiscard]] std::uint64_t planned_bytes() const;     // rows inside the arena
  [[nodiscard]] std::uint64_t high_water_bytes() const;  // planned bytes for rows without a counter
};

}  // namespace tactus::firmware
