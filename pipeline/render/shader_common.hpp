// What all programs of the renderer share: the frame's values, the real images behind a pixel, the light.
#pragma once

namespace tactus::render {

/// The uniform block `Frame` (std140: vec4 and mat4 only, so that the layout is plain), written once per
/// picture.
struct FrameBlock {
  float projection[16];    // optical frame -> clip
  float shadow[16];        // optical frame -> shadow map: u, v, depth in [0, 1]; w = 1
  float homography[3][4];  // columns: pixel of the picture -> pixel of the real images; fourth not used
  float pinhole[4];        // fx, fy, cx, cy
  float picture[4];        // width, height in pixels; occlusion bias: constant (m), times z^2 (1/m)
  float toward_light[4];   // unit, optical frame; w: 1 when there are shadows, else 0
  float light_x[4];        // unit, optical frame, across the light
  float up[4];             // unit, optical frame
  float light_color[4];    // linear
  float ambient_up[4];
  float ambient_down[4];
  float clip[4];  // near, far (m); unused; a shadow map's texel (m)
  float real[4];  // overlay alpha; 1 when there is real depth, 1 when there is video, else 0; unused
};

inline constexpr const char* kShaderCommon = R"(#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DShadow;
precision highp usampler2D;

layout(std140) uniform Frame {
  mat4 projection;
  mat4 shadow;
  mat3 homography;
  vec4 pinhole;
  vec4 picture;
  vec4 toward_light;
  vec4 light_x;
  vec4 up;
  vec4 light_color;
  vec4 ambient_up;
  vec4 ambient_down;
  vec4 clip;
  vec4 real;
};
)";

// Two programs from one text: software rasterisers run both sides of a branch, and the warp's division costs
// where nothing turned.
inline constexpr const char* kWithWarp = "#define WITH_WARP\n";
inline constexpr const char* kWithoutWarp = "";

inline constexpr const char* kShaderReal = R"(
// This pixel's place in the picture: centres at integers, row 0 at the top (the framebuffer's is at the bottom).
vec2 picture_pixel() { return vec2(gl_FragCoord.x - 0.5, picture.y - gl_FragCoord.y - 0.5); }

// Direction of this pixel's ray in the optical frame, z = 1.
vec3 pixel_ray() { return vec3((picture_pixel() - pinhole.zw) / pinhole.xy, 1.0); }

// Pixel of the real images seen there; z: what their depths are divided by to be depths of the picture; 0: none.
#ifdef WITH_WARP
vec3 real_pixel(vec2 offset) {
  vec3 seen = homography * vec3(picture_pixel() + offset, 1.0);
  vec2 pixel = floor(seen.xy / seen.z + 0.5);
  bool is_inside = seen.z > 0.0 && all(greaterThanEqual(pixel, vec2(0.0))) && all(lessThan(pixel, picture.xy));
  return is_inside ? vec3(pixel, seen.z) : vec3(0.0);
}
#else
vec3 real_pixel(vec2 offset) {
  return vec3(clamp(picture_pixel() + offset, vec2(0.0), picture.xy - 1.0), 1.0);
}
#endif
)";

inline constexpr const char* kShaderRealDepth = R"(
uniform sampler2D real_depth_m;

// Depth of the real surface in the picture's camera at an offset of pixels; not above 0: nothing measured.
float real_z(vec2 offset) {
  vec3 pixel = real_pixel(offset);
  float measured = texelFetch(real_depth_m, ivec2(pixel.xy), 0).r;
#ifdef WITH_WARP
  measured = pixel.z > 0.0 ? measured / pixel.z : 0.0;
#endif
  return measured;
}
)";

inline constexpr const char* kShaderShadow = R"(
uniform sampler2DShadow shadow_map;

// Share of the lamp that reaches a point. 4 mm towards the light: rounding and depth noise make no shadow.
float lamp_share(vec3 point) {
  vec3 place = (shadow * vec4(point + 0.004 * toward_light.xyz, 1.0)).xyz;
  return texture(shadow_map, place);
}

vec3 ambient(float up_part) { return mix(ambient_down.rgb, ambient_up.rgb, 0.5 + 0.5 * up_part); }
)";

// GGX (Walter et al. 2007), Smith's visibility by Hammon's approximation (2017), Fresnel by Schlick (1994),
// with the division by pi left to the units of Light. No pow(): products cost a tenth of it in software.
// Square and root stand for the sRGB curve: at most 4 % of white off. Ambient gloss is the hemisphere in the
// mirror direction.
inline constexpr const char* kShaderVirtual = R"(
float not_hidden(float nearest, vec2 offset) {
  float measured = real_z(offset);
  return measured > 0.0 && measured < nearest ? 0.0 : 1.0;
}

// Share of a pixel's four neighbours that show nothing real nearer than z by more than the sensor's noise: an edge is
// two pixels wide, not a staircase. Pixels without depth (0, NaN) hide nothing.
float visibility(float z) {
  if (real.y == 0.0) return 1.0;
  float nearest = z - picture.z - picture.w * z * z;
  return 0.25 * (not_hidden(nearest, vec2(1.0, 0.0)) + not_hidden(nearest, vec2(-1.0, 0.0)) +
                 not_hidden(nearest, vec2(0.0, 1.0)) + not_hidden(nearest, vec2(0.0, -1.0)));
}

float fifth_power(float x) {
  float x2 = x * x;
  return x2 * x2 * x;
}

vec3 lit(vec3 albedo, vec2 finish, vec3 normal, vec3 point) {
  vec3 base = albedo * albedo;
  vec3 view = -normalize(point);
  vec3 halfway = normalize(toward_light.xyz + view);
  float facing = max(dot(normal, toward_light.xyz), 0.0);
  float n_view = max(dot(normal, view), 0.001);
  float n_half = max(dot(normal, halfway), 0.0);
  float roughness = max(finish.x, 0.15);
  float a = roughness * roughness;
  float a2 = a * a;
  float d = n_half * n_half * (a2 - 1.0) + 1.0;
  vec3 mirrored = mix(vec3(0.04), base, finish.y);
  vec3 fresnel = mirrored + (1.0 - mirrored) * fifth_power(1.0 - max(dot(view, halfway), 0.0));
  vec3 gloss = fresnel * (a2 / (d * d) * 0.5 / mix(2.0 * facing * n_view, facing + n_view, a));
  vec3 diffuse = base * (1.0 - finish.y);

  // Off the surface by a texel and a half: a texel of the map spans a slope of the body itself.
  float reaching = facing * lamp_share(point + 1.5 * clip.w * normal);
  float n_up = dot(normal, up.xyz);
  float mirrored_up = 2.0 * n_view * n_up - dot(view, up.xyz);
  vec3 mirrored_sky = mirrored + max(vec3(1.0 - roughness) - mirrored, 0.0) * fifth_power(1.0 - n_view);
  vec3 linear = (diffuse + gloss) * reaching * light_color.rgb + diffuse * ambient(n_up) +
                mirrored_sky * ambient(mirrored_up);
  return sqrt(min(linear, 1.0));
}
)";

}  // namespace tactus::render
