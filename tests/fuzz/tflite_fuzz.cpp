// Bytes of a .tflite file: reader, plan and, for networks of a size that ends in time, the builder too.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "pipeline/segment/network.hpp"
#include "pipeline/segment/tflite_model.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  std::vector<std::byte> aligned(bytes);
  if (bytes > 0) std::memcpy(aligned.data(), data, bytes);
  const auto model = tactus::segment::read_tflite(aligned, "fuzz.tflite");
  if (!model) return 0;
  const auto plan = tactus::segment::plan_network(*model);
  if (!plan || plan->tensor_bytes > (1U << 22)) return 0;
  static_cast<void>(tactus::segment::Network::bytes_needed(*model));
  return 0;
}
