// Two materials meet: one law of contact.
#pragma once

#include "pipeline/contact/materials.hpp"

namespace tactus::contact {

struct ContactLaw {
  double restitution = 0;
  double static_friction = 0;
  double kinetic_friction = 0;
  double rolling_resistance = 0;
  double compliance_m_per_n = 0;
};

/// Restitution by shares of strain energy: in a collision the energy is stored in the two bodies in
/// proportion to their compliance 1/E, and body i returns the fraction e_i^2 of its share, so
///   e^2 = (e_1^2 / E_1 + e_2^2 / E_2) / (1 / E_1 + 1 / E_2)   (the stiffness-weighted rule; Coaplen et al.
///   2004).
/// Against a much stiffer partner each material shows its own table value, and the softer one decides: a
/// rubber ball bounces on stone but not on carpet. Products or minima of the two numbers have neither
/// property. Friction: geometric mean. Rolling resistance and compliance add (losses add; springs in series).
/// Step; wait-free.
ContactLaw combine(const ContactProperties& a, const ContactProperties& b) noexcept;

/// The expected law over the posterior of the surface: sum of p_i * combine(body, material_i). Probabilities
/// that do not sum to 1 are normalised; an empty distribution is "other". Step; wait-free.
ContactLaw expected_law(const ContactProperties& body, const MaterialDistribution& surface,
                        const MaterialTable& table) noexcept;

}  // namespace tactus::contact
