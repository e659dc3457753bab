// What all programs of the renderer share: the frame's values, the test against real depth, the light.
#pragma once

namespace tactus::render {

/// The uniform block `Frame` (std140: vec4 only, so that the layout is plain), written once per picture.
struct FrameBlock {
  float projection[16];   // optical frame -> clip
  float pinhole[4];       // fx, fy, cx, cy
  float picture[4];       // width, height in pixels; occlusion bias: constant (m), times z^2 (1/m)
  float toward_light[4];  // unit, optical frame
  float up[4];            // unit, optical frame
  float clip[4];          // near, far (m); unused
  float real[4];          // overlay alpha; 1 when there is real depth, 1 when there is video, else 0; unused
};

inline constexpr const char* kShaderCommon = R"(#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;

layout(std140) uniform Frame {
  mat4 projection;
  vec4 pinhole;
  vec4 picture;
  vec4 toward_light;
  vec4 up;
  vec4 clip;
  vec4 real;
};
)";

inline constexpr const char* kShaderVirtual = R"(
uniform sampler2D real_depth_m;

// Images have row 0 at the top, the framebuffer at the bottom.
ivec2 image_pixel() { return ivec2(int(gl_FragCoord.x), int(picture.y) - 1 - int(gl_FragCoord.y)); }

// Direction of this pixel's ray in the optical frame, z = 1.
vec3 pixel_ray() {
  vec2 uv = vec2(gl_FragCoord.x - 0.5, picture.y - gl_FragCoord.y - 0.5);
  return vec3((uv - pinhole.zw) / pinhole.xy, 1.0);
}

// Something real is nearer than z by more than the sensor's noise. Pixels without depth (0, NaN) hide nothing.
bool is_hidden(float z) {
  if (real.y == 0.0) return false;
  float measured = texelFetch(real_depth_m, image_pixel(), 0).r;
  return measured > 0.0 && z > measured + picture.z + picture.w * z * z;
}

vec3 lit(vec3 albedo, vec3 normal, vec3 point) {
  float sky = 0.5 + 0.5 * dot(normal, up.xyz);
  float facing = max(dot(normal, toward_light.xyz), 0.0);
  vec3 halfway = normalize(toward_light.xyz - normalize(point));
  float gloss = facing > 0.0 ? max(dot(normal, halfway), 0.0) : 0.0;
  gloss *= gloss;  // to the 32nd power; pow() makes a picture of 30 bodies 5 % slower
  gloss *= gloss;
  gloss *= gloss;
  gloss *= gloss;
  gloss *= gloss;
  return albedo * (0.3 + 0.22 * sky + 0.55 * facing) + 0.3 * gloss;
}
)";

}  // namespace tactus::render
