// What an impact leaves on a surface: said by the table of materials, drawn by the renderer.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tactus {

/// none: nothing is left (water closes again). The rest by looks: a round pit with a rim (stone, plaster), rays of cracks
/// about a hole (glass), a hole with torn fibres (cloth, paper), one with long splinters (wood), a dent with bare metal.
enum class DecalKind : std::uint8_t { none, crater, cracks, tear, splinter, dent };
inline constexpr std::size_t kDecalKindsCount = 6;
inline constexpr std::array<std::string_view, kDecalKindsCount> kDecalKindNames = {"none", "crater",   "cracks",
                                                                                    "tear", "splinter", "dent"};

}  // namespace tactus
