// Frames of reference and the typed rigid transform between them.
//
//   world   right-handed, metres, y up along gravity once gravity is known, origin at the first depth camera
//   depth   optical frame of the depth camera: x right, y down, z forward
//   color   optical frame of the colour camera: same axes
//
// T_world_depth maps a point from the right-hand name to the left-hand one: p_world = T_world_depth * p_depth; inner
// names cancel: T_world_color = T_world_depth * T_depth_color. A chain that does not cancel does not compile.
// Only + - * / sqrt are used, in a fixed order: results are the same bits on every IEEE machine.
#pragma once

#include <array>
#include <cmath>

namespace tactus {

struct World {};
struct Depth {};
struct Color {};

template <typename Scalar>
struct Vec3 {
  Scalar x{}, y{}, z{};

  constexpr Vec3 operator+(const Vec3& o) const { return {x + o.x, y + o.y, z + o.z}; }
  constexpr Vec3 operator-(const Vec3& o) const { return {x - o.x, y - o.y, z - o.z}; }
  constexpr Vec3 operator-() const { return {-x, -y, -z}; }
  constexpr Vec3 operator*(Scalar s) const { return {x * s, y * s, z * s}; }
  constexpr Vec3& operator+=(const Vec3& o) { return *this = *this + o; }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
  [[nodiscard]] constexpr Scalar dot(const Vec3& o) const { return x * o.x + y * o.y + z * o.z; }
  [[nodiscard]] constexpr Vec3 cross(const Vec3& o) const {
    return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x};
  }
  [[nodiscard]] Scalar norm() const { return std::sqrt(dot(*this)); }
  [[nodiscard]] Vec3 normalized() const {
    const Scalar n = norm();
    return n > Scalar(0) ? *this * (Scalar(1) / n) : Vec3{};
  }
  template <typename Other>
  [[nodiscard]] constexpr Vec3<Other> cast() const {
    return {static_cast<Other>(x), static_cast<Other>(y), static_cast<Other>(z)};
  }
};
using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

/// Hamilton quaternion; unit length when it stands for a rotation.
struct Quaternion {
  double w = 1, x = 0, y = 0, z = 0;

  [[nodiscard]] Quaternion normalized() const {
    const double n = std::sqrt(w * w + x * x + y * y + z * z);
    return {w / n, x / n, y / n, z / n};
  }
  constexpr Quaternion operator*(const Quaternion& o) const {
    return {w * o.w - x * o.x - y * o.y - z * o.z, w * o.x + x * o.w + y * o.z - z * o.y,
            w * o.y - x * o.z + y * o.w + z * o.x, w * o.z + x * o.y - y * o.x + z * o.w};
  }
};

/// Rotation matrix, row-major.
struct Rotation {
  std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};

  constexpr double operator()(int row, int column) const { return m[static_cast<std::size_t>(row * 3 + column)]; }
  constexpr Vec3d operator*(const Vec3d& v) const {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
  }
  constexpr Rotation operator*(const Rotation& o) const {
    Rotation r;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        r.m[i * 3 + j] = m[i * 3] * o.m[j] + m[i * 3 + 1] * o.m[3 + j] + m[i * 3 + 2] * o.m[6 + j];
    return r;
  }
  [[nodiscard]] constexpr Rotation transposed() const {
    return {{m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}};
  }
  /// Unit quaternion with w >= 0 (Shepperd's method: the largest of the four squares is divided by).
  [[nodiscard]] Quaternion quaternion() const;
  static Rotation from(const Quaternion& q);
};

inline Rotation Rotation::from(const Quaternion& q) {
  const double xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
  const double xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z;
  const double wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
  return {{1 - 2 * (yy + zz), 2 * (xy - wz), 2 * (xz + wy), 2 * (xy + wz), 1 - 2 * (xx + zz), 2 * (yz - wx),
           2 * (xz - wy), 2 * (yz + wx), 1 - 2 * (xx + yy)}};
}

inline Quaternion Rotation::quaternion() const {
  const Rotation& r = *this;
  const double trace = r(0, 0) + r(1, 1) + r(2, 2);
  Quaternion q;
  if (trace > 0) {
    const double s = 2 * std::sqrt(1 + trace);
    q = {s / 4, (r(2, 1) - r(1, 2)) / s, (r(0, 2) - r(2, 0)) / s, (r(1, 0) - r(0, 1)) / s};
  } else if (r(0, 0) > r(1, 1) && r(0, 0) > r(2, 2)) {
    const double s = 2 * std::sqrt(1 + r(0, 0) - r(1, 1) - r(2, 2));
    q = {(r(2, 1) - r(1, 2)) / s, s / 4, (r(0, 1) + r(1, 0)) / s, (r(0, 2) + r(2, 0)) / s};
  } else if (r(1, 1) > r(2, 2)) {
    const double s = 2 * std::sqrt(1 + r(1, 1) - r(0, 0) - r(2, 2));
    q = {(r(0, 2) - r(2, 0)) / s, (r(0, 1) + r(1, 0)) / s, s / 4, (r(1, 2) + r(2, 1)) / s};
  } else {
    const double s = 2 * std::sqrt(1 + r(2, 2) - r(0, 0) - r(1, 1));
    q = {(r(1, 0) - r(0, 1)) / s, (r(0, 2) + r(2, 0)) / s, (r(1, 2) + r(2, 1)) / s, s / 4};
  }
  if (q.w < 0) q = {-q.w, -q.x, -q.y, -q.z};
  return q.normalized();
}

/// Rigid transform that maps points of frame From to frame To.
template <typename To, typename From>
struct Transform {
  Rotation rotation;
  Vec3d translation;

  Vec3d operator*(const Vec3d& p_from) const { return rotation * p_from + translation; }
  template <typename Other>
  Transform<To, Other> operator*(const Transform<From, Other>& o) const {
    return {rotation * o.rotation, rotation * o.translation + translation};
  }
  [[nodiscard]] Transform<From, To> inverse() const {
    const Rotation rt = rotation.transposed();
    return {rt, -(rt * translation)};
  }
  /// Removes the rounding drift of long products; call once per accepted pose.
  [[nodiscard]] Transform orthonormalized() const { return {Rotation::from(rotation.quaternion()), translation}; }
  [[nodiscard]] bool is_finite() const {
    double sum = translation.x + translation.y + translation.z;
    for (double v : rotation.m) sum += v;
    return std::isfinite(sum);
  }
};

using T_WorldDepth = Transform<World, Depth>;
using T_DepthColor = Transform<Depth, Color>;
using T_ColorDepth = Transform<Color, Depth>;

}  // namespace tactus
