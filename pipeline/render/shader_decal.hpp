// Marks on real surfaces: one program for each kind, from one text. Each pixel's real point decides what is
// drawn.
#pragma once

#include <array>

#include "pipeline/label/decal_kind.hpp"

namespace tactus::render {

inline constexpr const char* kDecalVertex = R"(
layout(location = 0) in vec4 rectangle_ndc;
layout(location = 1) in vec4 disc;  // centre, radius
layout(location = 2) in vec3 axis_x;
layout(location = 3) in vec3 axis_y;
layout(location = 4) in vec4 tint;
layout(location = 5) in uint seed;
flat out vec4 disc_depth_m;
flat out vec3 disc_x;
flat out vec3 disc_y;
flat out vec3 inner;
flat out vec2 lamp;  // the part of the light's direction that lies in the disc
flat out uint salt;

void main() {
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  gl_Position = vec4(mix(rectangle_ndc.xy, rectangle_ndc.zw, corner), 0.0, 1.0);
  disc_depth_m = disc;
  disc_x = axis_x;
  disc_y = axis_y;
  inner = tint.rgb;
  lamp = vec2(dot(toward_light.xyz, axis_x), dot(toward_light.xyz, axis_y));
  salt = seed;
}
)";

// A kind is a function mark(q, pixel): colour and opacity at q in the unit disc, where a pixel is `pixel`
// wide.
inline constexpr const char* kDecalNoise = R"(
flat in vec4 disc_depth_m;
flat in vec3 disc_x;
flat in vec3 disc_y;
flat in vec3 inner;
flat in vec2 lamp;
flat in uint salt;
out vec4 color;

float chance(int x, int y) {
  uint n = uint(x) * 0x9e3779b1u ^ uint(y) * 0x85ebca77u ^ salt * 0xc2b2ae3du;
  n = (n ^ (n >> 15)) * 0x2c1b3c6du;
  n ^= n >> 12;
  return float(n & 0xffffu) / 65535.0;
}

// Smooth in x, another one for each row; period > 0 closes it.
float wave(float x, int period, int row) {
  float cell = floor(x);
  int i = int(cell), j = i + 1;
  if (period > 0) j = j == period ? 0 : j;
  float t = x - cell;
  return mix(chance(i, row), chance(j, row), t * t * (3.0 - 2.0 * t));
}

float noise(vec2 p) {
  float row = floor(p.y);
  float t = p.y - row;
  return mix(wave(p.x, 0, int(row)), wave(p.x, 0, int(row) + 1), t * t * (3.0 - 2.0 * t));
}

// The angle of q as a number in [0, sectors).
float around(vec2 q, float sectors) { return clamp((atan(q.y, q.x) / 6.2831853 + 0.5) * sectors, 0.0, sectors - 0.001); }

// `over` covers `under`.
vec4 cover(vec4 under, vec4 over) {
  float a = over.a + under.a * (1.0 - over.a);
  return vec4((over.rgb * over.a + under.rgb * under.a * (1.0 - over.a)) / max(a, 0.001), a);
}
)";

inline constexpr const char* kCrater = R"(
vec4 mark(vec2 q, float pixel) {
  float r = length(q);
  vec2 outward = q / max(r, 0.001);
  float soft = max(pixel, 0.03);
  float grain = noise(q * 9.0);
  float edge = 0.34 + 0.16 * wave(around(q, 11.0), 11, 7) + 0.07 * grain;
  float lit = dot(outward, lamp);
  // Dust thrown about, a raised rim, the pit: its wall that faces the lamp is the far one.
  float dust = (1.0 - smoothstep(edge, 0.98, r)) * smoothstep(0.25, 0.8, grain + 0.35 * wave(around(q, 23.0), 23, 8));
  vec4 shown = vec4(mix(inner, vec3(1.0), 0.45), 0.55 * dust);
  float rim = 1.0 - smoothstep(0.0, 0.13, abs(r - edge - 0.06));
  shown = cover(shown, vec4(clamp(mix(inner, vec3(1.0), 0.25) * (0.85 + 0.5 * lit), 0.0, 1.0), 0.85 * rim));
  float depth = 1.0 - r / max(edge, 0.001);
  vec3 pit = inner * clamp(0.42 - 0.5 * lit * (1.0 - depth) - 0.35 * depth + 0.25 * (grain - 0.5), 0.04, 0.9);
  return cover(shown, vec4(pit, 0.96 * (1.0 - smoothstep(edge - soft, edge + soft, r))));
}
)";

inline constexpr const char* kCracks = R"(
vec4 mark(vec2 q, float pixel) {
  const float kSectors = 11.0;
  float r = length(q);
  float width = max(0.6 * pixel, 0.011);
  float a = around(q, kSectors) + 0.28 * (wave(r * 6.0, 0, 31) - 0.5);
  if (a < 0.0) a += kSectors;
  if (a >= kSectors) a -= kSectors;
  float sector = floor(a + 0.5);
  if (sector >= kSectors) sector = 0.0;
  int i = int(sector);
  // Rays start jittered about the sectors' borders and end anywhere from half way on.
  float off = a - sector - 0.55 * (chance(i, 3) - 0.5);
  if (off > 0.5 * kSectors) off -= kSectors;
  float away = r * abs(off) * 6.2831853 / kSectors;
  float reach = 0.5 + 0.48 * chance(i, 4);
  float taper = mix(1.1, 0.35, r);
  float ray = (1.0 - smoothstep(taper * width, 2.0 * taper * width, away)) * step(r, reach);
  float glint = (1.0 - smoothstep(width, 2.2 * width, abs(away - 2.0 * width))) * step(r, reach);

  // Rings are straight between two rays, at another distance in each sector, and not in all.
  float facet = floor(a);
  int f = int(facet);
  float straight = r * cos((a - facet - 0.5) * 6.2831853 / kSectors);
  float ring = 0.0, band = 0.0;
  for (int k = 0; k < 3; ++k) {
    float at = 0.2 + 0.21 * float(k) + 0.1 * (chance(f, 10 + k) - 0.5);
    ring = max(ring, (1.0 - smoothstep(width, 2.2 * width, abs(straight - at))) * step(chance(f, 20 + k), 0.75));
    band += step(at, straight);
  }
  float bright = chance(f, 40 + int(band));
  vec4 shown = vec4(mix(inner, vec3(1.0), 0.8), 0.5 * bright * bright * (1.0 - smoothstep(0.35, 0.85, r)));
  shown = cover(shown, vec4(0.96, 0.98, 1.0, max(0.5 * glint, 0.75 * ring)));
  shown = cover(shown, vec4(0.08, 0.1, 0.11, 0.85 * ray));
  float hole = 0.06 + 0.07 * wave(a, 11, 50);
  return cover(shown, vec4(0.03, 0.03, 0.04, 0.95 * (1.0 - smoothstep(hole - width, hole + width, r))));
}
)";

inline constexpr const char* kTear = R"(
vec4 mark(vec2 q, float pixel) {
  float soft = max(pixel, 0.025);
  float bend = 0.16 * (wave(q.x * 2.0 + 9.0, 0, 1) - 0.5);
  float y = q.y - bend;
  int side = y > 0.0 ? 2 : 3;
  float x2 = q.x * q.x;
  float fray = wave(q.x * 16.0 + 40.0, 0, side);
  float thread = wave(q.x * 34.0 + 80.0, 0, side + 2);
  float open = 0.27 * max(1.0 - x2 * 1.15, 0.0);
  float half_width = open * (0.62 + 0.5 * fray);
  float away = abs(y);
  // The cloth sinks to the slit; its torn edge shows fibres, some of which hang into the dark.
  float sunk = (1.0 - smoothstep(half_width, half_width + 0.3, away)) * smoothstep(0.9, 0.5, x2);
  vec4 shown = vec4(inner * 0.25, 0.5 * sunk);
  float hem = smoothstep(half_width + 0.12 * thread + soft, half_width, away) * step(0.001, open);
  shown = cover(shown, vec4(mix(inner, vec3(1.0), 0.3 + 0.35 * thread), 0.9 * hem));
  float hole = smoothstep(half_width + 0.5 * soft, half_width - soft, away) * step(0.001, open);
  shown = cover(shown, vec4(0.035, 0.03, 0.03, 0.97 * hole));
  float hanging = smoothstep(0.68, 0.8, thread) * smoothstep(0.25, 0.6, away / max(half_width, 0.001)) * hole;
  return cover(shown, vec4(inner * 0.85, 0.85 * hanging));
}
)";

inline constexpr const char* kSplinter = R"(
vec4 mark(vec2 q, float pixel) {
  const float kStrips = 13.0;
  float y = q.y * kStrips + 0.7 * (wave(q.x * 3.0 + 20.0, 0, 1) - 0.5);
  float strip = floor(y);
  int i = int(strip) + 64;
  float within = abs(y - strip - 0.5) * 2.0;  // 0 in the middle of a strip, 1 at its border
  float open = max(1.0 - q.y * q.y * 3.2, 0.0);
  float end = q.x > 0.0 ? chance(i, 2) : chance(i, 3);
  float x = abs(q.x);
  // Strips end in points; inside a hole with a jagged border, outside raw wood that was lifted off.
  float tip = open * (0.42 + 0.55 * end);
  float hole = open * (0.1 + 0.34 * chance(i, q.x > 0.0 ? 4 : 5));
  float soft = max(pixel, 0.02);
  float raw = smoothstep(soft, -soft, x - tip * (1.0 - 0.45 * within * within)) * step(0.001, open);
  float grain = wave(q.x * 7.0 + 3.0 * chance(i, 6), 0, i);
  vec4 shown = vec4(mix(inner, vec3(1.0, 0.93, 0.78), 0.5) * (0.72 + 0.3 * grain + 0.22 * chance(i, 8)), 0.95 * raw);
  float gap = smoothstep(0.62, 0.98, within) * raw;
  shown = cover(shown, vec4(inner * 0.18, 0.85 * gap));
  float dark = smoothstep(soft, -soft, x - hole * (1.0 - 0.5 * within * within)) * step(0.001, open);
  return cover(shown, vec4(inner * 0.1, 0.96 * dark));
}
)";

inline constexpr const char* kDent = R"(
vec4 mark(vec2 q, float pixel) {
  float r = length(q);
  vec2 outward = q / max(r, 0.001);
  float edge = 0.72 + 0.1 * wave(around(q, 7.0), 7, 1);
  float part = clamp(r / edge, 0.0, 1.0);
  float slope = part * (1.0 - part * part) * 2.4;
  float lit = -dot(outward, lamp) * slope;
  float scratch = smoothstep(0.72, 0.95, wave(q.y * 46.0 + 100.0, 0, 2)) * wave(q.x * 3.0 + 60.0, 0, 3);
  float sunk = 1.0 - smoothstep(0.55, 1.0, part);
  vec4 shown = vec4(inner * (0.52 + 0.25 * scratch), 0.6 * sunk);
  shown = cover(shown, vec4(step(0.0, lit) * vec3(1.0), clamp(abs(lit), 0.0, 1.0) * 0.75));
  float rim = 1.0 - smoothstep(0.0, max(0.055, pixel), abs(r - edge));
  shown = cover(shown, vec4(mix(inner, vec3(1.0), 0.75), rim * clamp(0.45 + 0.6 * dot(outward, lamp), 0.1, 0.95)));
  return cover(shown, vec4(mix(inner, vec3(1.0), 0.6), 0.5 * scratch * sunk));
}
)";

inline constexpr std::array<const char*, kDecalKindsCount> kDecalMarks = {"",    kCrater,   kCracks,
                                                                          kTear, kSplinter, kDent};

inline constexpr const char* kDecalFragment = R"(
void main() {
  float z = real_z(vec2(0.0));
  if (!(z > clip.x && z < clip.y)) discard;
  vec3 from_center = z * pixel_ray() - disc_depth_m.xyz;
  vec2 q = vec2(dot(from_center, disc_x), dot(from_center, disc_y)) / disc_depth_m.w;
  float off_plane = abs(dot(from_center, cross(disc_x, disc_y)));
  float r = length(q);
  if (r >= 1.0 || off_plane >= 0.02) discard;
  color = mark(q, z / (pinhole.x * disc_depth_m.w));
  color.a *= smoothstep(0.02, 0.013, off_plane) * smoothstep(1.0, 0.94, r);
}
)";

}  // namespace tactus::render
