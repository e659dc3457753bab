#include "firmware_host/bench_machine.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "firmware_host/bench_time.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "firmware_host/bench_machine.cpp"
#include "hwy/foreach_target.h"
// clang-format off
#include "hwy/highway.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace tactus::firmware::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// x <- x / 2 + 1, in place; count is a multiple of four vectors of any target.
void ReadModifyWrite(float* x, std::size_t count) {
  const hn::ScalableTag<float> d;
  const std::size_t lanes = hn::Lanes(d);
  const auto half = hn::Set(d, 0.5f), one = hn::Set(d, 1.0f);
  for (std::size_t i = 0; i < count; i += 4 * lanes)
    for (std::size_t k = 0; k < 4; ++k) {
      float* p = x + i + k * lanes;
      hn::Store(hn::Add(hn::Mul(hn::Load(d, p), half), one), d, p);
    }
}

template <bool kFused, class V>
HWY_INLINE V Step(V x, V factor, V addend) {
  if constexpr (kFused) {
    return hn::MulAdd(x, factor, addend);
  } else {
    return hn::Add(hn::Mul(x, factor), addend);
  }
}

// Twelve chains: more than latency (4 cycles) times issue width (2) of today's cores, and they fit 16
// registers.
template <bool kFused>
HWY_INLINE float Chains(std::size_t rounds_count) {
  const hn::ScalableTag<float> d;
  const auto m = hn::Set(d, 0.999f), a = hn::Set(d, 0.001f);
  auto x0 = hn::Set(d, 0.0f), x1 = hn::Set(d, 0.1f), x2 = hn::Set(d, 0.2f), x3 = hn::Set(d, 0.3f);
  auto x4 = hn::Set(d, 0.4f), x5 = hn::Set(d, 0.5f), x6 = hn::Set(d, 0.6f), x7 = hn::Set(d, 0.7f);
  auto x8 = hn::Set(d, 0.8f), x9 = hn::Set(d, 0.9f), x10 = hn::Set(d, 1.0f), x11 = hn::Set(d, 1.1f);
  for (std::size_t i = 0; i < rounds_count; ++i) {
    x0 = Step<kFused>(x0, m, a);
    x1 = Step<kFused>(x1, m, a);
    x2 = Step<kFused>(x2, m, a);
    x3 = Step<kFused>(x3, m, a);
    x4 = Step<kFused>(x4, m, a);
    x5 = Step<kFused>(x5, m, a);
    x6 = Step<kFused>(x6, m, a);
    x7 = Step<kFused>(x7, m, a);
    x8 = Step<kFused>(x8, m, a);
    x9 = Step<kFused>(x9, m, a);
    x10 = Step<kFused>(x10, m, a);
    x11 = Step<kFused>(x11, m, a);
  }
  const auto sum = hn::Add(
      hn::Add(hn::Add(x0, x1), hn::Add(x2, x3)),
      hn::Add(hn::Add(hn::Add(x4, x5), hn::Add(x6, x7)), hn::Add(hn::Add(x8, x9), hn::Add(x10, x11))));
  return hn::GetLane(hn::SumOfLanes(d, sum));
}

float MulAddChains(std::size_t rounds_count) { return Chains<false>(rounds_count); }
float FusedChains(std::size_t rounds_count) { return Chains<true>(rounds_count); }
std::size_t LanesCount() { return hn::Lanes(hn::ScalableTag<float>()); }
const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace tactus::firmware::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::firmware {
HWY_EXPORT(ReadModifyWrite);
HWY_EXPORT(MulAddChains);
HWY_EXPORT(FusedChains);
HWY_EXPORT(LanesCount);
HWY_EXPORT(TargetName);

namespace {

constexpr int kTriesCount = 7;
constexpr double kFlopsPerStep = 2, kChainsCount = 12;
constexpr std::size_t kRounds = 1'000'000;  // some 5 ms
constexpr std::size_t kRmwFloats = (std::size_t{64} << 20) / sizeof(float);
constexpr std::size_t kLineBytes = 64, kLoadsCount = 400'000;

volatile float float_sink;  // results are used, so that the work is done
volatile std::uint32_t index_sink;

/// Least CPU time of several tries, ns.
template <typename Work>
double best_ns(const Work& work) {
  double best = 0;
  for (int i = 0; i < kTriesCount; ++i) {
    const BenchInstant begin = BenchInstant::now();
    work();
    const auto ns = static_cast<double>(BenchInstant::now().cpu_ns - begin.cpu_ns);
    best = i == 0 ? ns : std::min(best, ns);
  }
  return std::max(best, 1.0);
}

/// One index a cache line, each naming the next of a single cycle through all lines in random order
/// (Sattolo's shuffle), so that no prefetcher can know it.
double load_latency_ns(std::size_t bytes) {
  constexpr std::size_t kPerLine = kLineBytes / sizeof(std::uint32_t);
  const std::size_t lines = bytes / kLineBytes;
  std::vector<std::uint32_t> order(lines);
  for (std::size_t i = 0; i < lines; ++i) order[i] = static_cast<std::uint32_t>(i);
  std::uint64_t state = 1;
  for (std::size_t i = lines - 1; i > 0; --i) {
    state = state * 6364136223846793005ull + 1442695040888963407ull;  // Knuth's MMIX generator
    std::swap(order[i], order[(state >> 33) % i]);
  }
  std::vector<std::uint32_t> next(lines * kPerLine);
  for (std::size_t i = 0; i < lines; ++i)
    next[order[i] * kPerLine] = order[(i + 1) % lines] * static_cast<std::uint32_t>(kPerLine);
  std::uint32_t at = 0;
  const double ns = best_ns([&] {
    for (std::size_t i = 0; i < kLoadsCount; ++i) at = next[at];
    index_sink = at;
  });
  return ns / static_cast<double>(kLoadsCount);
}

}  // namespace

MachineBaseline measure_machine() {
  MachineBaseline baseline;
  baseline.vector_target = HWY_DYNAMIC_DISPATCH(TargetName)();
  const double flops = kFlopsPerStep * kChainsCount * static_cast<double>(kRounds) *
                       static_cast<double>(HWY_DYNAMIC_DISPATCH(LanesCount)());
  baseline.mul_add_gflops = flops / best_ns([] { float_sink = HWY_DYNAMIC_DISPATCH(MulAddChains)(kRounds); });
  baseline.fused_gflops = flops / best_ns([] { float_sink = HWY_DYNAMIC_DISPATCH(FusedChains)(kRounds); });
  {
    // Vector loads are aligned to the widest target's vectors, which no std::vector promises.
    std::vector<float> memory(kRmwFloats + 64, 1.0f);
    const auto misalignment = reinterpret_cast<std::uintptr_t>(memory.data()) % 256;
    float* first = memory.data() + (misalignment == 0 ? 0 : (256 - misalignment) / sizeof(float));
    const double ns = best_ns([&] { HWY_DYNAMIC_DISPATCH(ReadModifyWrite)(first, kRmwFloats); });
    baseline.rmw_gb_per_s = 2.0 * static_cast<double>(kRmwFloats * sizeof(float)) / ns;
    float_sink = first[kRmwFloats / 2];
  }
  for (LoadLatency& load : baseline.loads) load.ns = load_latency_ns(load.bytes);
  return baseline;
}

double slowness(const MachineBaseline& baseline) {
  return std::max({kReferenceRmwGbPerS / baseline.rmw_gb_per_s, kReferenceFusedGflops / baseline.fused_gflops,
                   baseline.loads.back().ns / kReferenceLoad8MibNs});
}

}  // namespace tactus::firmware
#endif  // HWY_ONCE
