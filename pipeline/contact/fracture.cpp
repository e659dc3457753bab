#include "pipeline/contact/fracture.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactus::contact {
namespace {

/// Sum of p_i f(i) over the posterior, normalised; f("other") where nothing is known.
template <typename F>
double expected(const MaterialDistribution& surface, F&& f) {
  double sum = 0, mass = 0;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const auto p = static_cast<double>(surface[i]);
    if (!(p > 0)) continue;
    sum += p * f(static_cast<MaterialId>(i));
    mass += p;
  }
  return mass > 0 ? sum / mass : f(material_from_name("other"));
}

double body_stiffness(const Build& build, double youngs_modulus_pa) {
  return 1.65 * youngs_modulus_pa * build.wall_m * build.wall_m * build.wall_m / (build.span_m * build.span_m);
}

double bending_share_on(MaterialId surface, const Build& build, MaterialId body, const MaterialTable& table) {
  if (!(build.wall_m > 0)) return 0;
  const double stiffness = body_stiffness(build, table.of(body).youngs_modulus_pa);
  return 1 / (1 + stiffness / (table.of(surface).youngs_modulus_pa * kContactLengthM));
}

}  // namespace

double breaking_energy_j(const Build& build, MaterialId material, const MaterialTable& table) noexcept {
  const FractureProperties& fracture = table.fracture_of(material);
  if (!(build.wall_m > 0) || fracture.pattern == BreakPattern::none) return std::numeric_limits<double>::infinity();
  const double strength = fracture.strength_pa;
  return build.volume_m3 * strength * strength / (18 * table.of(material).youngs_modulus_pa);
}

double bending_share(const Build& build, MaterialId body, const MaterialDistribution& surface,
                     const MaterialTable& table) noexcept {
  return expected(surface, [&](MaterialId id) { return bending_share_on(id, build, body, table); });
}

ImpactVerdict judge_impact(const Build& build, MaterialId body, const ContactProperties& body_properties,
                           const MaterialDistribution& surface, double energy_j, const MaterialTable& table) noexcept {
  ImpactVerdict verdict;
  verdict.bending_energy_j = energy_j * bending_share(build, body, surface, table);
  // What does not bend the body strains the contact, and the more compliant side takes the larger part of it.
  const double give_body = 1 / body_properties.youngs_modulus_pa;
  verdict.surface_energy_j = expected(surface, [&](MaterialId id) {
    const double give = 1 / table.of(id).youngs_modulus_pa;
    return (energy_j - verdict.bending_energy_j) * give / (give + give_body);
  });
  const double held_j = breaking_energy_j(build, body, table);
  // A plate at 5 m/s has six times the energy it holds: by the expected share alone it would break on what is a cushion for 80 %.
  const double breaking = expected(surface, [&](MaterialId id) {
    return energy_j * bending_share_on(id, build, body, table) > held_j ? 1.0 : 0.0;
  });
  const bool breaks = breaking > 0.5;
  // A brittle surface that a breaking thing hits sheds chips of the energy that broke it, too.
  const double chips = expected(surface, [&](MaterialId id) {
    const FractureProperties& fracture = table.fracture_of(id);
    const bool is_brittle = fracture.pattern == BreakPattern::shards;
    return fracture.chips_per_joule * (is_brittle && breaks ? energy_j : verdict.surface_energy_j);
  });
  verdict.chips_count = std::min(kChipsMax, static_cast<int>(chips + 0.5));
  const double brittle = expected(surface, [&](MaterialId id) {
    return table.fracture_of(id).pattern == BreakPattern::shards ? 1.0 : 0.0;
  });
  if (breaks) {
    verdict.outcome = brittle > 0.5 && verdict.chips_count > 0 ? Outcome::broke_with_chips : Outcome::broke;
  } else {
    const double restitution = expected_law(body_properties, surface, table).restitution;
    verdict.outcome = restitution >= kBounceSeen ? Outcome::bounced : Outcome::intact;
  }
  return verdict;
}

}  // namespace tactus::contact
