// What each of the 23 materials does when something touches it.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "pipeline/label/decal_kind.hpp"
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

/// How a thing of this material comes apart.
enum class BreakPattern : std::uint8_t { none, shards, crumbs, splinters, fibres };
inline constexpr std::array<std::string_view, 5> kBreakPatternNames = {"none", "shards", "crumbs", "splinters",
                                                                       "fibres"};

struct FractureProperties {
  BreakPattern pattern = BreakPattern::none;  // none: it never breaks and sheds nothing
  double strength_pa = 1e9;        // bending stress at which it breaks; with E the energy a body holds before (fracture.hpp)
  double chips_per_joule = 0;      // seen flying off for each joule that an impact leaves in it
  DecalKind decal = DecalKind::none;
  double decal_radius_m = 0;       // of the mark that one joule leaves; grows with the cube root of the energy
};

struct SoundProperties {
  double mode_frequency_hz = 1000;  // lowest mode of a hand-sized (10 cm) piece
  double loss_factor = 0.01;        // internal, eta: a mode f falls by 60 dB in 2.2 / (f eta) seconds
  double noise_share = 0;           // of an impact's energy that sounds without pitch, 0..1
  std::array<double, 3> absorption{};  // share of sound energy a surface swallows at 250, 1000 and 4000 Hz
};

/// As physically based renderers use them.
struct LookProperties {
  double optical_roughness = 0.5;  // perceptual, 0 mirror .. 1 matt
  double metalness = 0;            // 0 dielectric .. 1 metal
};

struct MaterialTable {
  std::array<ContactProperties, kMaterialCount> properties{};
  std::array<FractureProperties, kMaterialCount> fracture{};
  std::array<SoundProperties, kMaterialCount> sound{};
  std::array<LookProperties, kMaterialCount> look{};

  /// Unknown materials answer as "other".
  [[nodiscard]] const ContactProperties& of(MaterialId id) const {
    return properties[row(id)];
  }
  [[nodiscard]] const FractureProperties& fracture_of(MaterialId id) const { return fracture[row(id)]; }
  [[nodiscard]] const SoundProperties& sound_of(MaterialId id) const { return sound[row(id)]; }
  [[nodiscard]] const LookProperties& look_of(MaterialId id) const { return look[row(id)]; }

 private:
  static constexpr std::size_t row(MaterialId id) {
    return id < kMaterialCount ? id : material_from_name("other");
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
