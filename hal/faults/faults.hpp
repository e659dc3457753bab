// Faults of cameras on purpose: wrappers around any sensor's cameras that do to its frames what real devices do.
//
// Which frames are hit depends on the plan, the stream and the frame's number alone, never on time or on who asks when:
// a session with faults is the same bits every time under the lockstep runner.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/camera.hpp"
#include "rt/clock.hpp"
#include "rt/status.hpp"

namespace tactus::hal::faults {

enum class FaultKind : std::uint8_t {
  drop,                 // the frame vanishes, its number leaves a gap
  duplicate,            // it is delivered twice, with the same number and time
  late,                 // `arrived` is later by `delay`; with a clock, read() holds it back as long
  out_of_order,         // its successor comes first
  corrupt_bytes,        // `share` of the image's bytes are replaced; nobody can tell
  half_frame,           // read() answers corrupt, as a device does when part of a transfer is missing
  stuck_clock,          // it has the time of the last frame that was not hit
  clock_jump,           // its time and those of all later frames move by `jump`
  color_without_depth,  // of depth: read() answers timeout in the frame's place, colour goes on
  unplug,               // this frame and those after it vanish for a while; read() answers device_lost in their place
  slow_consumer         // with a clock, the read() after it waits for `delay` before it looks for the next
};
inline constexpr std::size_t kFaultKinds = 11;
inline constexpr std::array<std::string_view, kFaultKinds> kFaultNames = {
    "drop",        "duplicate",  "late",                "out_of_order", "corrupt_bytes", "half_frame",
    "stuck_clock", "clock_jump", "color_without_depth", "unplug",       "slow_consumer"};

struct Fault {
  FaultKind kind = FaultKind::drop;
  bool hits_depth = true, hits_color = true;
  // May be hit: frames number first, first + every, first + 2 * every ..., `count` of them; each is with `probability`.
  std::uint64_t first = 0, every = 1;
  std::uint64_t count = kEndless;
  double probability = 1;
  rt::Duration delay{};           // late, slow_consumer
  rt::Duration jump{};            // clock_jump; may be negative
  double share = 0.01;            // corrupt_bytes
  std::uint64_t away_frames = 0;  // unplug: numbers that are lost; 0: by `away`
  rt::Duration away{};            // unplug: on the sensor's clock

  static constexpr std::uint64_t kEndless = ~std::uint64_t{0};
};

struct FaultPlan {
  std::uint64_t seed = 1;
  std::vector<Fault> faults;
};

/// Reads
///   seed = 1
///   [[fault]]
///   kind = "drop"       # a name out of kFaultNames
///   stream = "both"     # depth | color | both; both where it is not said
///   first = 30          # and count = 6: frames 30 to 35; count is 1 where it is not said
///   every = 10          # instead: frames 10, 20, 30 ..., from `first` on and `count` of them where those are said
///   probability = 0.05  # instead, or of those that every names
///   delay_ms = 40       # late, slow_consumer
///   jump_ms = -500      # clock_jump
///   share = 0.01        # corrupt_bytes; 0.01 where it is not said
///   away_frames = 45    # unplug; or away_ms
/// bad_usage with FILE:LINE for anything else. Boot.
rt::Result<FaultPlan> parse_faults(std::string_view text, const std::string& file);
rt::Result<FaultPlan> load_faults(const std::string& file);

/// What was done to frames so far. Written by the thread that reads the cameras.
struct FaultCounts {
  // By Stream and FaultKind: frames hit; of unplug, times; of out_of_order, pairs that changed places.
  std::array<std::array<std::uint64_t, kFaultKinds>, 2> injected{};

  [[nodiscard]] std::uint64_t of(Stream stream, FaultKind kind) const {
    return injected[static_cast<std::size_t>(stream)][static_cast<std::size_t>(kind)];
  }
};

/// Puts faulty cameras around those of `sensor`, with all the memory they need; its buffers_bytes and description say so.
/// With a clock, late frames and slow consumers are waited for, within the timeouts of read() and peek(); without,
/// nothing waits. A tap sees what the source gave. Counters are the source's with half frames, losses and the frames that
/// vanished (frames_missing) added; frames_delivered counts answers of ok. While unplugged, every read takes one frame of
/// the source; of a recording, colour that is unplugged together with depth is asked when depth is back, so it passes
/// over all of them in one answer. Boot.
std::shared_ptr<const FaultCounts> inject(const FaultPlan& plan, Sensor& sensor, std::optional<rt::Clock> clock = {});

}  // namespace tactus::hal::faults
