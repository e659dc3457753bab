// A walker as the renderer draws it: a small figure of six bodies.
#pragma once

#include <array>
#include <cstddef>

#include "pipeline/interact/agent.hpp"
#include "pipeline/render/body.hpp"

namespace tactus {

inline constexpr std::size_t kFigureParts = 6;  // body, head, two eyes, two feet

/// Feet on the ground, swinging with the way walked; as high and wide as WalkerBody says that it needs room.
/// Any phase, wait-free.
std::array<render::Body, kFigureParts> drawn_figure(const interact::AgentPose& pose,
                                                    std::size_t index) noexcept;

}  // namespace tactus
