// Trajectories to be judged: whatever the file, accepted poses rise in time and are rigid, and judging them
// against themselves finds no error.
#include <cstddef>
#include <cstdint>

#include "pipeline/evaluate/trajectory.hpp"
#include "rt/assert.hpp"
#include "tests/fuzz/memory_file.hpp"

using namespace tactus;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  static test::MemoryFile file;
  const auto trajectory = evaluate::read_tum_trajectory(file.holding(data, bytes));
  if (!trajectory) {
    TACTUS_ASSERT(trajectory.error().code == rt::ExitCode::bad_input && !trajectory.error().message.empty());
    return 0;
  }
  const auto& poses = trajectory.value().poses;
  for (std::size_t i = 1; i < poses.size(); ++i) TACTUS_ASSERT(poses[i - 1].time < poses[i].time);
  const auto report = evaluate::evaluate_trajectory(poses, poses);
  TACTUS_ASSERT(report.has_value() == (poses.size() >= 3));
  if (report) TACTUS_ASSERT(report.value().pairs_count == poses.size());
  return 0;
}
