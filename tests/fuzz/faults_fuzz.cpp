// Text of a file of faults: the TOML library and the schema above it.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "hal/faults/faults.hpp"
#include "rt/assert.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  using namespace tactus::hal::faults;
  const auto plan = parse_faults({reinterpret_cast<const char*>(data), bytes}, "fuzz.toml");
  if (!plan) return 0;
  for (const Fault& fault : plan->faults) {
    TACTUS_ASSERT(static_cast<std::size_t>(fault.kind) < kFaultKinds);
    TACTUS_ASSERT(fault.hits_depth || fault.hits_color);
    TACTUS_ASSERT(fault.every > 0 && fault.count > 0);
    TACTUS_ASSERT(fault.probability >= 0 && fault.probability <= 1 && fault.share >= 0 && fault.share <= 1);
    TACTUS_ASSERT(fault.delay.ns >= 0 && fault.away.ns >= 0);
    TACTUS_ASSERT(fault.kind != FaultKind::unplug || (fault.away_frames > 0) != (fault.away.ns > 0));
  }
  return 0;
}
