// What this machine can do at best, measured in the same run as the stages: a figure beside it can be read on
// any machine.
#pragma once

#include <array>
#include <cstddef>

namespace tactus::firmware {

struct LoadLatency {
  std::size_t bytes = 0;  // of the buffer walked through
  double ns = 0;          // per dependent load, 4 KiB pages, misses of the address cache included
};

/// Of one thread, by CPU time, the best of several tries.
struct MachineBaseline {
  const char* vector_target = "";  // Highway's name of the instructions used
  double rmw_gb_per_s = 0;         // 64 MB in place, bytes read and bytes written both counted, 10^9
  double mul_add_gflops = 0;       // fp32, a multiplication and an addition: what the stages use
  double fused_gflops = 0;         // fp32, fused: what the machine could
  std::array<LoadLatency, 3> loads = {{{32u << 10, 0}, {1u << 20, 0}, {8u << 20, 0}}};
};

/// The machine that the limits were set on, one core at 3.4 GHz (AVX-512): the same measures.
inline constexpr double kReferenceRmwGbPerS = 42, kReferenceFusedGflops = 116, kReferenceLoad8MibNs = 137;

/// How much slower than that machine this one is at what it is slowest at; below 1 when it is faster at
/// everything. Limits times this are a hint, no more.
double slowness(const MachineBaseline& baseline);

/// About a second. Allocates. Boot.
MachineBaseline measure_machine();

}  // namespace tactus::firmware
