// The rooms' contents.
#pragma once

#include "hal/synthetic/scene.hpp"

namespace tactus::hal::synthetic {

Scene::Parts make_bedroom();
Scene::Parts make_office();
Scene::Parts make_wall();
Scene::Parts make_corner();

}  // namespace tactus::hal::synthetic
