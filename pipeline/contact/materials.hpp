// What each of the 23 materials does when something touches it.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "pipeline/label/material.hpp"
#include "rt/status.hpp"

namespace tactus::contact {

/// Properties of one material, as numbers of that material alone; contact_law.hpp combines two. SI.
struct ContactProperties {
  double restitution = 0;  // rebound speed / approach speed against something elastic and much stiffer; 0..1
  double static_friction = 0;       // of the material on itself; pairs take the geometric mean
  double kinetic_friction = 0;      // <= static_friction
  double rolling_resistance = 0;    // force / normal force of a hard 5 cm ball rolling on it
  double youngs_modulus_pa = 1;     // small-strain, of what is touched (a carpet's pile, not its fibre)
  double compliance_m_per_n = 0;    // how far the surface gives under a resting body
  double density_kg_per_m3 = 1000;  // of a body made of it
  double roughness_m = 0;           // arithmetic mean height of the surface, Ra
};

struct MaterialTable {
  std::array<ContactProperties, kMaterialCount> properties{};

  /// Unknown materials answer as "other".
  [[nodiscard]] const ContactProperties& of(MaterialId id) const {
    constexpr MaterialId kOther = material_from_name("other");
    return properties[id < kMaterialCount ? id : kOther];
  }
};

/// Reads a table. All 23 materials and every key must be there, each number with a source (or "estimated"),
/// inside its physical range; anything else is one sentence with file, line and key, exit code bad_usage.
/// Boot.
rt::Result<MaterialTable> parse_material_table(std::string_view toml, const std::string& file_name);
rt::Result<MaterialTable> load_material_table(const std::string& path);

/// The table that is compiled in from pipeline/contact/materials.toml. Boot.
MaterialTable default_material_table();
std::string_view default_material_toml();

}  // namespace tactus::contact
