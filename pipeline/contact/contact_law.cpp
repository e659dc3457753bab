#include "pipeline/contact/contact_law.hpp"

#include <cmath>

namespace tactus::contact {

ContactLaw combine(const ContactProperties& a, const ContactProperties& b) noexcept {
  const double give_a = 1 / a.youngs_modulus_pa;
  const double give_b = 1 / b.youngs_modulus_pa;
  const double returned =
      (a.restitution * a.restitution * give_a + b.restitution * b.restitution * give_b) / (give_a + give_b);
  return {.restitution = std::sqrt(returned),
          .static_friction = std::sqrt(a.static_friction * b.static_friction),
          .kinetic_friction = std::sqrt(a.kinetic_friction * b.kinetic_friction),
          .rolling_resistance = a.rolling_resistance + b.rolling_resistance,
          .compliance_m_per_n = a.compliance_m_per_n + b.compliance_m_per_n};
}

ContactLaw expected_law(const ContactProperties& body, const MaterialDistribution& surface,
                        const MaterialTable& table) noexcept {
  // What is left out below this probability cannot move any coefficient by more than half a per cent of its
  // range.
  constexpr double kNegligible = 0.0002;
  ContactLaw sum;
  double mass = 0;
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const double p = static_cast<double>(surface[i]);
    if (!(p > kNegligible)) continue;
    const ContactLaw law = combine(body, table.properties[i]);
    sum.restitution += p * law.restitution;
    sum.static_friction += p * law.static_friction;
    sum.kinetic_friction += p * law.kinetic_friction;
    sum.rolling_resistance += p * law.rolling_resistance;
    sum.compliance_m_per_n += p * law.compliance_m_per_n;
    mass += p;
  }
  if (!(mass > 0)) return combine(body, table.of(kUnknownMaterial));
  const double scale = 1 / mass;
  return {sum.restitution * scale, sum.static_friction * scale, sum.kinetic_friction * scale,
          sum.rolling_resistance * scale, sum.compliance_m_per_n * scale};
}

}  // namespace tactus::contact
