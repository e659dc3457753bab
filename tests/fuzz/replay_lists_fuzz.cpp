// Frame lists of recordings: whatever the text, the good entries' times strictly increase and nothing is lost
// unseen.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "hal/replay/lists.hpp"
#include "rt/assert.hpp"

using namespace tactus;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  const std::string_view text(reinterpret_cast<const char*>(data), bytes);
  const auto list = hal::replay::parse_frame_list(text, "depth.txt");
  if (!list) {
    TACTUS_ASSERT(list.error().code == rt::ExitCode::bad_input && !list.error().message.empty());
    return 0;
  }
  std::optional<rt::SensorTime> before;
  std::uint64_t sequence = 0;
  for (const hal::replay::ListEntry& entry : list.value().entries) {
    TACTUS_ASSERT(entry.sequence == sequence++ && entry.line > 0);
    if (entry.fault != hal::replay::ListEntry::Fault::none) continue;
    TACTUS_ASSERT(!entry.path.empty() && (!before || *before < entry.time));
    before = entry.time;
  }
  TACTUS_ASSERT(before.has_value());
  const hal::replay::TimeIndex index(list.value());
  TACTUS_ASSERT(index.nearest(*before, rt::Duration{}).has_value());
  return 0;
}
