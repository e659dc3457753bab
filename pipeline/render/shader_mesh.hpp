// Boxes, cylinders, capsules and hulls: the vertices of one mesh, carried by each instance's half axes.
#pragma once

namespace tactus::render {

inline constexpr const char* kMeshAttributes = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 face;
layout(location = 2) in float cap;
layout(location = 3) in vec3 half_axis_x;
layout(location = 4) in vec3 half_axis_y;
layout(location = 5) in vec3 half_axis_z;
layout(location = 6) in vec4 center_half_length;
layout(location = 7) in vec4 albedo;
layout(location = 8) in vec4 finish;

vec3 vertex_depth_m() {
  vec3 ends = cap * center_half_length.w * normalize(half_axis_z);
  return mat3(half_axis_x, half_axis_y, half_axis_z) * position + ends + center_half_length.xyz;
}
)";

inline constexpr const char* kMeshVertex = R"(
out vec3 point;
out vec3 normal;
flat out vec3 mesh_albedo;
flat out vec2 mesh_finish;

void main() {
  point = vertex_depth_m();
  // The inverse transpose of orthogonal axes: each divided by its squared length.
  normal = face.x / dot(half_axis_x, half_axis_x) * half_axis_x + face.y / dot(half_axis_y, half_axis_y) * half_axis_y +
           face.z / dot(half_axis_z, half_axis_z) * half_axis_z;
  normal = normalize(normal);
  mesh_albedo = albedo.rgb;
  mesh_finish = finish.xy;
  gl_Position = projection * vec4(point, 1.0);
}
)";

inline constexpr const char* kMeshFragment = R"(
in vec3 point;
in vec3 normal;
flat in vec3 mesh_albedo;
flat in vec2 mesh_finish;
out vec4 color;

void main() {
  float seen = visibility(point.z);
  if (seen == 0.0) discard;
  color = vec4(lit(mesh_albedo, mesh_finish, normalize(normal), point), seen);
}
)";

}  // namespace tactus::render
