// The light of a picture: one distant lamp and what comes from above and below, as virtual things see it.
#pragma once

#include "hal/transform.hpp"

namespace tactus::render {

/// Colours are linear (not sRGB) and in units of what a white Lambert surface sends back: facing the lamp and
/// up it has the radiance color + ambient_up. The default shows a material's colour as it is where the lamp
/// shines head-on.
struct Light {
  Vec3f toward_world{0.35F, 0.85F, 0.4F};  // to the lamp; need not be unit, must not be zero
  Vec3f color{0.7F, 0.7F, 0.7F};
  Vec3f ambient_up{0.34F, 0.34F, 0.34F};  // on a surface that faces world up (+y)
  Vec3f ambient_down{0.2F, 0.2F, 0.2F};   // on one that faces down
};

}  // namespace tactus::render
