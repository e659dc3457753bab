// Text of a class map: the TOML library and the schema above it.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "pipeline/segment/class_map.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  static_cast<void>(
      tactus::segment::parse_class_map({reinterpret_cast<const char*>(data), bytes}, "fuzz.toml"));
  return 0;
}
