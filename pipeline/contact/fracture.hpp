// When a thing breaks, and what an impact does to the surface that it hits.
//
// Two springs in series take an impact's energy: the contact between the two materials, and the thing itself, which
// bends. The softer one takes more, so a plate breaks on a tile and not on a cushion, whose contact is softer than the
// plate by a factor of ten thousand:
//   share = 1 / (1 + k_body / k_contact),  k_contact = E_surface L,  k_body = 1.65 E_body h^3 / a^2
// (the middle of a simply supported round plate, Roark's Formulas, 7th ed., table 11.2, nu = 0.22). It breaks when that
// share exceeds what it holds elastically: 1/9 sigma^2 / (2 E) of its volume (a beam's bending stress is triangular both
// along and across). Of a surface that may be one thing or another, what is more probable happens: it breaks where the
// materials that break it have more than half of the posterior.
#pragma once

#include "pipeline/contact/contact_law.hpp"
#include "pipeline/contact/materials.hpp"

namespace tactus::contact {

/// What of a body's build decides whether it breaks; a body without walls is solid and does not break here.
struct Build {
  double wall_m = 0;         // thickness of the part that bends; 0: does not break
  double span_m = 0;         // radius of that part
  double volume_m3 = 0;      // of material, not of the space it encloses
};

/// Length over which two stiff bodies touch: a rim or an edge of a plate.
inline constexpr double kContactLengthM = 0.001;

/// Energy that a body of this build holds before it breaks, joules; infinite when it does not break. Any phase.
double breaking_energy_j(const Build& build, MaterialId material, const MaterialTable& table) noexcept;

/// Share of an impact's energy that bends the body, expected over the posterior of the surface, 0..1. Any phase.
double bending_share(const Build& build, MaterialId body, const MaterialDistribution& surface,
                     const MaterialTable& table) noexcept;

/// Energy of an impact, joules, by the approach speed and the whole mass. A rim that is hit takes less, for less of the body
/// moves, but holds less in the same proportion: with the mass at the contact in place of the whole, a plate would survive
/// any throw that does not land flat. Against another body `other_mass_kg` gives the reduced mass. Any phase.
inline double impact_energy_j(double mass_kg, double impact_speed_m_per_s, double other_mass_kg = 0) noexcept {
  const double mass = other_mass_kg > 0 ? mass_kg * other_mass_kg / (mass_kg + other_mass_kg) : mass_kg;
  return 0.5 * mass * impact_speed_m_per_s * impact_speed_m_per_s;
}

/// What people see of an impact (the paper's user study, section V-B; plates of its figure 7).
enum class Outcome : std::uint8_t { through, intact, bounced, broke, broke_with_chips };
inline constexpr std::size_t kOutcomesCount = 5;
inline constexpr std::array<std::string_view, kOutcomesCount> kOutcomeNames = {"through", "intact", "bounced", "broke",
                                                                              "broke with chips"};
/// A rebound with less of the speed looks like no bounce: 6 % of the height.
inline constexpr double kBounceSeen = 0.25;

struct ImpactVerdict {
  Outcome outcome = Outcome::intact;
  double bending_energy_j = 0;   // in the body
  double surface_energy_j = 0;   // in the surface, where marks and chips come from
  int chips_count = 0;           // that fly off the surface, expected over its posterior, 0 .. kChipsMax
};
inline constexpr int kChipsMax = 12;

/// Judges one impact. `energy_j`: impact_energy_j(). Chips fly when the surface is likely to be brittle (shards) or when
/// the energy left in it makes one. Step; wait-free.
ImpactVerdict judge_impact(const Build& build, MaterialId body, const ContactProperties& body_properties,
                           const MaterialDistribution& surface, double energy_j, const MaterialTable& table) noexcept;

}  // namespace tactus::contact
