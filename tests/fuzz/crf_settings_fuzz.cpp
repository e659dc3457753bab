// Text of CRF settings: the TOML library and the schema above it.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "pipeline/label/crf/crf_settings.hpp"
#include "rt/assert.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  const auto parameters =
      tactus::label::parse_crf_parameters({reinterpret_cast<const char*>(data), bytes}, "fuzz.toml");
  if (parameters) TACTUS_ASSERT(tactus::label::is_valid(*parameters));
  return 0;
}
