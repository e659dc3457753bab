// What one impact sounds like, as a mono clip: modes of the two things that meet, and their contact's noise.
//
// Modal synthesis after van den Doel, Kry, Pai 2001, "FoleyAutomatic", and O'Brien, Shen, Gatchalian 2002,
// "Synthesizing Sounds from Rigid-Body Simulations": each mode is a decaying sine, struck by the force of the
// contact.
//
//   pitch     the material's lowest mode for a 10 cm piece, times 0.1 m / size; the others stand to it as in
//             a free plate
//   decay     by 60 dB in 2.2 / (f eta) seconds
//   contact   Hertz: t_c = 2.87 (m^2 / (R E*^2 v))^(1/5) (Johnson 1985, Contact Mechanics, 11.4); its
//             force is half a sine of that length, so that a soft partner excites low modes only
//   energy    parts in the ratio of the two compliances 1 / E: the softer of the two is heard more
//   loudness  x / sqrt(1 + x^2) with x^2 = energy / 0.25 J, what 100 g have after a fall of 25 cm: grows with
//             every impact and never reaches full scale
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/contact/materials.hpp"

namespace tactus::sound {

inline constexpr int kSampleRateHz = 48000;
inline constexpr std::size_t kClipSamplesMax = kSampleRateHz;  // a clip that rings on is faded out by then
inline constexpr int kModesPerPart = 8;

struct Strike {
  MaterialId body_material = kUnknownMaterial;  // unknown sounds like "other"
  MaterialId surface_material = kUnknownMaterial;
  double body_size_m = 0.1;   // its longest edge or its diameter
  double surface_size_m = 0;  // of another body; 0: a surface of the room
  double energy_j = 0;        // that the impact takes from the motion; at least impulse times speed / 2
  double impulse_n_s = 0;     // along the normal
  double speed_m_per_s = 0;   // of approach
  std::uint32_t seed = 1;     // where it was struck: which modes answer more, by up to 6 dB
};

struct Mode {
  double frequency_hz = 0;
  double decay_per_s = 0;  // amplitude falls as exp(-decay t)
  double amplitude = 0;    // of the sine
};

/// A strike as numbers of the signal. All amplitudes together are at most 1.
struct StrikeSpectrum {
  std::array<Mode, 2 * kModesPerPart> modes{};  // the body's, then the surface's
  int modes_count = 0;                          // that are there
  double noise_amplitude = 0;
  double noise_cutoff_hz = 0;
  double noise_decay_s = 0;  // time constant
  double contact_time_s = 0;
};

/// Modes above 18 kHz are left out. No modes and no noise for a strike without energy or with numbers that
/// are not finite. Step; pure.
StrikeSpectrum spectrum_of(const Strike& strike, const contact::MaterialTable& table) noexcept;

/// Writes the clip into `out` (48 kHz, at most kClipSamplesMax of it) and answers how many samples sound; the
/// rest of `out` is not touched. The last of them is silence; |sample| <= 1. Starts at the first sample
/// without a click. `seed`: the grain of the noise. Up to 1 ms of processor time for a second of sound. Step;
/// no heap; the same bits for the same input.
std::size_t synthesize(const StrikeSpectrum& spectrum, std::uint32_t seed, std::span<float> out) noexcept;

}  // namespace tactus::sound
