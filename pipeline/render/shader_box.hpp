// Boxes: the unit cube's 36 corners, carried by each instance's half axes.
#pragma once

namespace tactus::render {

inline constexpr const char* kBoxVertex = R"(
layout(location = 0) in vec3 corner;  // each coordinate -1 or 1
layout(location = 1) in vec3 face;    // outward, along an axis
layout(location = 2) in vec3 half_axis_x;
layout(location = 3) in vec3 half_axis_y;
layout(location = 4) in vec3 half_axis_z;
layout(location = 5) in vec3 center;
layout(location = 6) in vec4 albedo;
out vec3 point;
flat out vec3 normal;
flat out vec3 box_albedo;

void main() {
  mat3 half_axes = mat3(half_axis_x, half_axis_y, half_axis_z);
  point = half_axes * corner + center;
  normal = normalize(half_axes * face);
  box_albedo = albedo.rgb;
  gl_Position = projection * vec4(point, 1.0);
}
)";

inline constexpr const char* kBoxFragment = R"(
in vec3 point;
flat in vec3 normal;
flat in vec3 box_albedo;
out vec4 color;

void main() {
  if (is_hidden(point.z)) discard;
  color = vec4(lit(box_albedo, normal, point), 1.0);
}
)";

}  // namespace tactus::render
