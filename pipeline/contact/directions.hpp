// Directions that shapes are sampled in: of a ball and of a circle.
#pragma once

#include <array>

#include "hal/transform.hpp"

namespace tactus::contact {

inline constexpr double kInvSqrt2 = 0.70710678118654752440;
inline constexpr double kInvSqrt3 = 0.57735026918962576451;

/// Axes, corners, edge midpoints of a cube. No direction is farther from one than 36.2 degrees with the first
/// 14, 27.4 with all.
inline constexpr std::array<Vec3d, 26> kBallDirections = {{
    {1, 0, 0},
    {-1, 0, 0},
    {0, 1, 0},
    {0, -1, 0},
    {0, 0, 1},
    {0, 0, -1},
    {kInvSqrt3, kInvSqrt3, kInvSqrt3},
    {-kInvSqrt3, kInvSqrt3, kInvSqrt3},
    {kInvSqrt3, -kInvSqrt3, kInvSqrt3},
    {-kInvSqrt3, -kInvSqrt3, kInvSqrt3},
    {kInvSqrt3, kInvSqrt3, -kInvSqrt3},
    {-kInvSqrt3, kInvSqrt3, -kInvSqrt3},
    {kInvSqrt3, -kInvSqrt3, -kInvSqrt3},
    {-kInvSqrt3, -kInvSqrt3, -kInvSqrt3},
    {kInvSqrt2, kInvSqrt2, 0},
    {-kInvSqrt2, kInvSqrt2, 0},
    {kInvSqrt2, -kInvSqrt2, 0},
    {-kInvSqrt2, -kInvSqrt2, 0},
    {kInvSqrt2, 0, kInvSqrt2},
    {-kInvSqrt2, 0, kInvSqrt2},
    {kInvSqrt2, 0, -kInvSqrt2},
    {-kInvSqrt2, 0, -kInvSqrt2},
    {0, kInvSqrt2, kInvSqrt2},
    {0, -kInvSqrt2, kInvSqrt2},
    {0, kInvSqrt2, -kInvSqrt2},
    {0, -kInvSqrt2, -kInvSqrt2},
}};
inline constexpr std::size_t kBallDirectionsFew = 14;

inline constexpr double kCos22 = 0.92387953251128675613;
inline constexpr double kSin22 = 0.38268343236508977173;

/// Sixteenths of a turn about z.
inline constexpr std::array<Vec3d, 16> kCircleDirections = {{
    {1, 0, 0},
    {kCos22, kSin22, 0},
    {kInvSqrt2, kInvSqrt2, 0},
    {kSin22, kCos22, 0},
    {0, 1, 0},
    {-kSin22, kCos22, 0},
    {-kInvSqrt2, kInvSqrt2, 0},
    {-kCos22, kSin22, 0},
    {-1, 0, 0},
    {-kCos22, -kSin22, 0},
    {-kInvSqrt2, -kInvSqrt2, 0},
    {-kSin22, -kCos22, 0},
    {0, -1, 0},
    {kSin22, -kCos22, 0},
    {kInvSqrt2, -kInvSqrt2, 0},
    {kCos22, -kSin22, 0},
}};

}  // namespace tactus::contact
