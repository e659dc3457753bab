// Materials tables of users: whatever the text, an accepted table keeps every number inside its physical
// range.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "pipeline/contact/materials.hpp"
#include "rt/assert.hpp"

using namespace tactus;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t bytes) {
  const std::string_view text(reinterpret_cast<const char*>(data), bytes);
  const auto table = contact::parse_material_table(text, "materials.toml");
  if (!table) {
    TACTUS_ASSERT(table.error().code == rt::ExitCode::bad_usage && !table.error().message.empty());
    return 0;
  }
  for (const contact::ContactProperties& p : table.value().properties) {
    TACTUS_ASSERT(p.restitution >= 0 && p.restitution <= 1);
    TACTUS_ASSERT(p.kinetic_friction >= 0 && p.kinetic_friction <= p.static_friction);
    TACTUS_ASSERT(p.youngs_modulus_pa > 0 && p.density_kg_per_m3 > 0);
    TACTUS_ASSERT(p.compliance_m_per_n >= 0 && p.roughness_m >= 0 && p.rolling_resistance >= 0);
  }
  return 0;
}
