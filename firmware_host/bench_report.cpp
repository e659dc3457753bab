#include "firmware_host/bench_report.hpp"

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace tactus::firmware {
namespace {

using nlohmann::json;

__attribute__((format(printf, 2, 3))) void append(std::string& text, const char* format, ...) {
  std::array<char, 512> line{};
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(line.data(), line.size(), format, arguments);
  va_end(arguments);
  text += line.data();
}

std::string number(double value, int decimals) {
  if (std::isnan(value)) return "-";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

const char* verdict(double value, const BenchLimit& limit) {
  if (std::isnan(limit.must)) return "";
  return value <= limit.goal ? "reaches the goal" : value <= limit.must ? "within must" : "OVER MUST";
}

json figures_json(const BenchFigures& f) { return {{"median", f.median}, {"p99", f.p99}, {"max", f.max}}; }

json limit_json(double value, const BenchLimit& limit) {
  return {{"value", value}, {"must", limit.must}, {"goal", limit.goal}};
}

double planned_mb(const BenchResult& r) { return static_cast<double>(r.planned_bytes) / 1e6; }

}  // namespace

std::string bench_text(const BenchResult& r) {
  const MachineBaseline& b = r.baseline;
  const double factor = slowness(b);
  std::string text;
  append(text, "%s\n%s, revision %s, %s\n%s\n\n", r.command.c_str(), r.date.c_str(), r.revision.c_str(),
         r.machine.compiler.c_str(), r.machine.description().c_str());
  append(text,
         "The machine now: %.1f threads want its %d core%s. CPU time is what this thread was given and the "
         "figure\n"
         "to trust on a shared machine; wall time holds the work of others too.\n\n",
         r.load, r.machine.cores_count, r.machine.cores_count == 1 ? "" : "s");
  append(text, "Machine baseline (one thread, %s, CPU time, best of 7)       here   reference\n",
         b.vector_target);
  append(text, "  read-modify-write of 64 MB, read + written    GB/s   %10.1f  %10.0f\n", b.rmw_gb_per_s,
         kReferenceRmwGbPerS);
  append(text, "  fp32 multiply, then add (what stages use)  GFLOP/s   %10.1f           -\n",
         b.mul_add_gflops);
  append(text, "  fp32 fused multiply-add                    GFLOP/s   %10.1f  %10.0f\n", b.fused_gflops,
         kReferenceFusedGflops);
  for (const LoadLatency& load : b.loads)
    append(text, "  dependent load in %5zu KiB                      ns   %10.1f  %10s\n", load.bytes >> 10,
           load.ns, load.bytes == b.loads.back().bytes ? number(kReferenceLoad8MibNs, 0).c_str() : "-");
  append(text,
         "  At what it is slowest at it takes %.2f times what the reference takes: 'here' below scales\n"
         "  the limits by that, as a hint.\n\n",
         factor);

  append(text,
         "Spine: synthetic:bedroom 640x480 with noise, %zu frames after %zu to warm up, %g cm voxels, "
         "truncation\n"
         "%g cm, one thread, %u blocks in the pool, up to %u in view; %llu frames lost. Milliseconds.\n",
         r.pass.cpu_ms[0].size(), r.warm_up_count, static_cast<double>(r.config.map.voxel_size_m) * 100,
         static_cast<double>(r.config.map.truncation_m) * 100, r.config.map.blocks_capacity,
         r.pass.active_blocks_max, static_cast<unsigned long long>(r.pass.frames_lost));
  append(text, "  %-10s %8s %8s %8s %8s   %6s %6s   %6s %6s\n", "", "CPU p50", "CPU p99", "wall p50",
         "wall p99", "must", "goal", "must", "goal");
  append(text, "  %-10s %8s %8s %8s %8s   %6s %6s   %6s %6s\n", "stage", "", "", "", "", "", "", "here",
         "here");
  for (std::size_t i = 0; i < kBenchStagesCount; ++i) {
    const BenchFigures cpu = figures_of(r.pass.cpu_ms[i]), wall = figures_of(r.pass.wall_ms[i]);
    const BenchLimit& limit = kBenchStageLimits_ms[i];
    append(text, "  %-10s %8.2f %8.2f %8.2f %8.2f   %6s %6s   %6s %6s%s%s\n", kBenchStages[i], cpu.median,
           cpu.p99, wall.median, wall.p99, number(limit.must, 1).c_str(), number(limit.goal, 1).c_str(),
           number(limit.must * factor, 1).c_str(), number(limit.goal * factor, 1).c_str(),
           std::isnan(limit.must) ? "" : "   ", verdict(cpu.median, limit));
  }
  append(text, "\n  %-46s %10s   %6s %6s\n", "", "", "must", "goal");
  append(text, "  %-46s %7.1f MB   %6.0f %6.0f   %s\n", "planned memory, x86 profile, no network",
         planned_mb(r), kBenchPlanned_mb.must, kBenchPlanned_mb.goal,
         verdict(planned_mb(r), kBenchPlanned_mb));
  append(text, "  %-46s %10.2f   %6.0f %6.0f   %s\n", "bytes per voxel, all in",
         r.bytes_per_voxel, kBenchBytesPerVoxel.must, kBenchBytesPerVoxel.goal,
         verdict(r.bytes_per_voxel, kBenchBytesPerVoxel));
  if (r.pass.heap_is_guarded) {
    append(text, "  %-46s %10llu   %6d %6d   %s\n", "heap calls in the stages after boot",
           static_cast<unsigned long long>(r.pass.heap_calls), 0, 0,
           r.pass.heap_calls == 0 ? "reaches the goal" : "OVER MUST");
  } else {
    append(text, "  %-46s %10s   %6d %6d   this build cannot see them\n",
           "heap calls in the stages after boot", "-", 0, 0);
  }
  const BenchLimit& growth = kBenchGrowth_percent;
  append(text, "  %-46s %+8.1f %%   %+6.0f %+6.0f   %s\n", "frame time in a map 10x larger than the view",
         r.growth_percent(), growth.must, growth.goal, verdict(r.growth_percent(), growth));
  append(text,
         "\n  The last: median total %.2f ms with %u blocks in the map, %.2f ms with %u (%.1f times the "
         "view); of each\n"
         "  frame the least CPU time of two passes each, taken in turns.\n",
         r.near_total_ms, r.near_blocks_used, r.far_total_ms, r.far_blocks_used,
         static_cast<double>(r.far_blocks_used) / std::max(1u, r.pass.active_blocks_max));
  return text;
}

json bench_json(const BenchResult& r) {
  const MachineBaseline& b = r.baseline;
  json loads = json::array();
  for (const LoadLatency& load : b.loads) loads.push_back({{"bytes", load.bytes}, {"ns", load.ns}});
  json stages = json::object();
  for (std::size_t i = 0; i < kBenchStagesCount; ++i) {
    json stage = {{"cpu_ms", figures_json(figures_of(r.pass.cpu_ms[i]))},
                  {"wall_ms", figures_json(figures_of(r.pass.wall_ms[i]))}};
    if (!std::isnan(kBenchStageLimits_ms[i].must)) {
      stage["must_ms"] = kBenchStageLimits_ms[i].must;
      stage["goal_ms"] = kBenchStageLimits_ms[i].goal;
    }
    stages[kBenchStages[i]] = stage;
  }
  json result = {{"command", r.command},
                 {"date", r.date},
                 {"revision", r.revision},
                 {"machine",
                  {{"description", r.machine.description()},
                   {"compiler", r.machine.compiler},
                   {"cores", r.machine.cores_count},
                   {"load_1min", r.load}}},
                 {"baseline",
                  {{"vector_target", b.vector_target},
                   {"rmw_gb_per_s", b.rmw_gb_per_s},
                   {"mul_add_gflops", b.mul_add_gflops},
                   {"fused_gflops", b.fused_gflops},
                   {"load_latency", loads},
                   {"slowness", slowness(b)}}},
                 {"source", "synthetic:bedroom"},
                 {"frames", r.pass.cpu_ms[0].size()},
                 {"frames_warm_up", r.warm_up_count},
                 {"frames_lost", r.pass.frames_lost},
                 {"blocks_capacity", r.config.map.blocks_capacity},
                 {"blocks_in_view", r.pass.active_blocks_max},
                 {"stages", stages},
                 {"planned_mb", limit_json(planned_mb(r), kBenchPlanned_mb)},
                 {"bytes_per_voxel", limit_json(r.bytes_per_voxel, kBenchBytesPerVoxel)},
                 {"map_10x",
                  {{"near_total_ms", r.near_total_ms},
                   {"far_total_ms", r.far_total_ms},
                   {"near_blocks", r.near_blocks_used},
                   {"far_blocks", r.far_blocks_used},
                   {"growth_percent", limit_json(r.growth_percent(), kBenchGrowth_percent)}}}};
  // Null where the build cannot see them: zero would be a claim.
  result["heap_calls"] = r.pass.heap_is_guarded ? json(r.pass.heap_calls) : json(nullptr);
  return result;
}

}  // namespace tactus::firmware
