// Compiling and linking GLSL at boot.
#pragma once

#include <cstdint>
#include <span>

#include "rt/status.hpp"

namespace tactus::render {

/// Links one program from two lists of source pieces, in order. The answer is its GL name, owned by the
/// caller. Boot; a context must be current. Error (device_unavailable): the driver's own words.
rt::Result<std::uint32_t> link_program(const char* name, std::span<const char* const> vertex_pieces,
                                       std::span<const char* const> fragment_pieces);

}  // namespace tactus::render
