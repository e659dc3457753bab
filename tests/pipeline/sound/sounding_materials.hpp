// A small table of materials for tests of sound: five that everybody can tell apart, and what rooms have.
#pragma once

#include "pipeline/contact/materials.hpp"

namespace tactus::sound::test {

inline MaterialId id_of(std::string_view name) { return material_from_name(name); }

/// Plausible for plates of 10 cm; the tests need no more than that they differ.
inline contact::MaterialTable sounding_materials() {
  contact::MaterialTable table;
  const auto set = [&table](std::string_view name, double modulus_pa, double frequency_hz, double loss,
                            double noise, std::array<double, 3> absorption) {
    table.properties[id_of(name)].youngs_modulus_pa = modulus_pa;
    table.sound[id_of(name)] = {frequency_hz, loss, noise, absorption};
  };
  set("glass", 6.5e10, 2100, 0.002, 0.02, {0.25, 0.12, 0.04});
  set("ceramic", 7e10, 3300, 0.006, 0.05, {0.01, 0.02, 0.02});
  set("metal", 2e11, 1100, 0.0005, 0.02, {0.05, 0.05, 0.05});
  set("wood", 1e10, 600, 0.02, 0.2, {0.15, 0.1, 0.1});
  set("fabric", 1e5, 120, 0.2, 0.8, {0.1, 0.5, 0.7});
  set("carpet", 2e5, 100, 0.25, 0.8, {0.1, 0.4, 0.65});
  set("painted", 3e9, 300, 0.02, 0.3, {0.02, 0.03, 0.04});
  set("other", 1e9, 800, 0.03, 0.3, {0.1, 0.1, 0.1});
  return table;
}

}  // namespace tactus::sound::test
