// Spheres, cut by each pixel's ray inside the rectangle that the sphere can cover.
#pragma once

namespace tactus::render {

inline constexpr const char* kSphereAttributes = R"(
layout(location = 0) in vec4 rectangle_ndc;
layout(location = 1) in vec4 sphere;  // centre, radius
layout(location = 2) in vec4 albedo;
layout(location = 3) in vec4 finish;
)";

inline constexpr const char* kSphereVertex = R"(
flat out vec4 sphere_depth_m;
flat out vec3 sphere_albedo;
flat out vec2 sphere_finish;

void main() {
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  gl_Position = vec4(mix(rectangle_ndc.xy, rectangle_ndc.zw, corner), 0.0, 1.0);
  sphere_depth_m = sphere;
  sphere_albedo = albedo.rgb;
  sphere_finish = finish.xy;
}
)";

// The closest approach of the ray is compared with the radius before squaring anything large: c.c - r^2 would
// lose a 2 cm ball at 4 m in rounding.
inline constexpr const char* kSphereFragment = R"(
flat in vec4 sphere_depth_m;
flat in vec3 sphere_albedo;
flat in vec2 sphere_finish;
out vec4 color;

void main() {
  vec3 ray = pixel_ray();
  vec3 center = sphere_depth_m.xyz;
  float radius = sphere_depth_m.w;
  float length2 = dot(ray, ray);
  float z_closest = dot(ray, center) / length2;
  vec3 offset = z_closest * ray - center;
  float inside2 = radius * radius - dot(offset, offset);
  if (inside2 < 0.0) discard;
  float z = z_closest - sqrt(inside2 / length2);
  float seen = visibility(z);
  if (z < clip.x || z > clip.y || seen == 0.0) discard;

  vec3 point = z * ray;
  color = vec4(lit(sphere_albedo, sphere_finish, (point - center) / radius, point), seen);
  float z_ndc = projection[2][2] + projection[3][2] / z;
  gl_FragDepth = 0.5 * z_ndc + 0.5;
}
)";

}  // namespace tactus::render
