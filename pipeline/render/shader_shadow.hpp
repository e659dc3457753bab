// Shadows: bodies drawn into the map of the light, and real surfaces darkened where the map says so.
#pragma once

namespace tactus::render {

inline constexpr const char* kCastMeshVertex = R"(
void main() { gl_Position = vec4(2.0 * (shadow * vec4(vertex_depth_m(), 1.0)).xyz - 1.0, 1.0); }
)";

inline constexpr const char* kCastMeshFragment = R"(
void main() {}
)";

// A sphere seen along the light is a disc; its depth is that of the half that faces the light.
inline constexpr const char* kCastSphereVertex = R"(
out vec2 disc;
flat out vec2 middle_bulge;  // depth of the centre, and how much nearer to the light the foremost point is

void main() {
  disc = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  vec3 light_y = cross(toward_light.xyz, light_x.xyz);
  vec3 corner = sphere.xyz + sphere.w * (disc.x * light_x.xyz + disc.y * light_y);
  vec3 place = (shadow * vec4(corner, 1.0)).xyz;
  float foremost = (shadow * vec4(sphere.xyz + sphere.w * toward_light.xyz, 1.0)).z;
  middle_bulge = vec2(place.z, place.z - foremost);
  gl_Position = vec4(2.0 * place - 1.0, 1.0);
}
)";

inline constexpr const char* kCastSphereFragment = R"(
in vec2 disc;
flat in vec2 middle_bulge;

void main() {
  float height2 = 1.0 - dot(disc, disc);
  if (height2 < 0.0) discard;
  gl_FragDepth = middle_bulge.x - sqrt(height2) * middle_bulge.y;
}
)";

// Each caster's ball swept away from the light is a prism; its back faces cover every pixel whose real
// surface can lie in its shadow, also when the eye is inside. All prisms lie at one depth, so that the depth
// test lets each pixel be darkened once, and the fragment program, which never discards, run once: 1e-6
// before the far plane, behind all bodies that end 4 mm before it.
inline constexpr const char* kShadeVertex = R"(
layout(location = 0) in vec3 corner;
layout(location = 1) in vec4 ball;
layout(location = 2) in vec2 sweep;  // begin, end (m)

void main() {
  vec3 light_y = cross(toward_light.xyz, light_x.xyz);
  vec3 point = ball.xyz + ball.w * (corner.x * light_x.xyz + corner.y * light_y) +
               (corner.z > 0.0 ? -sweep.x : -sweep.y) * toward_light.xyz;
  gl_Position = projection * vec4(point, 1.0);
  gl_Position.z = (1.0 - 1e-6) * gl_Position.w;
}
)";

// The video holds lamp and ambient light together; a shadow takes the lamp's share, which depends on how the
// surface faces: none where it faces away. Its normal is measured over a fortieth of the picture's width (a
// baseline of 6 cm at 2 m, against 8 mm of noise), and its depth is the mean over the same five pixels, which
// also closes small holes. Where they cross an edge (normals_of_depth's 5 cm + 2 %), the pixel's own depth is
// taken, facing the lamp.
inline constexpr const char* kShadeFragment = R"(
out vec4 factor;

void main() {
  vec3 ray = pixel_ray();
  float reach = max(floor(0.0125 * picture.x + 0.5), 1.0);
  float z = real_z(vec2(0.0));
  float left = real_z(vec2(-reach, 0.0)), right = real_z(vec2(reach, 0.0));
  float above = real_z(vec2(0.0, -reach)), below = real_z(vec2(0.0, reach));
  float mean = 0.25 * (left + right + above + below);
  bool is_measured = z > 0.0 && z < clip.y;
  z = is_measured ? z : mean;
  bool is_one_surface = all(lessThan(abs(vec4(left, right, above, below) - z), vec4(0.05 + 0.02 * z)));
  z = is_one_surface ? 0.2 * (4.0 * mean + z) : is_measured ? z : 0.0;
  float share = z > 0.0 && z < clip.y ? lamp_share(z * ray) : 1.0;

  vec2 step_ray = reach / pinhole.xy;
  vec3 along_u = (ray + vec3(step_ray.x, 0.0, 0.0)) * right - (ray - vec3(step_ray.x, 0.0, 0.0)) * left;
  vec3 along_v = (ray + vec3(0.0, step_ray.y, 0.0)) * below - (ray - vec3(0.0, step_ray.y, 0.0)) * above;
  vec3 normal = is_one_surface ? normalize(cross(along_v, along_u)) : toward_light.xyz;

  vec3 sky = ambient(dot(normal, up.xyz));
  vec3 ambient_share = sky / (sky + light_color.rgb * max(dot(normal, toward_light.xyz), 0.0) + 1e-6);
  factor = vec4(share == 1.0 ? vec3(1.0) : sqrt(mix(ambient_share, vec3(1.0), share)), 1.0);
}
)";

}  // namespace tactus::render
