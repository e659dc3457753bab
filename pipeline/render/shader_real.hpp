// The layer of real things: the video and the label overlay. One triangle over the picture.
#pragma once

namespace tactus::render {

inline constexpr const char* kRealVertex = R"(
void main() {
  vec2 corner = vec2(float((gl_VertexID << 1) & 2), float(gl_VertexID & 2));
  gl_Position = vec4(corner * 2.0 - 1.0, 1.0, 1.0);
}
)";

// Two programs from one text: software rasterisers run both sides of a branch, and the overlay's fetches cost
// as much as the whole video.
inline constexpr const char* kWithOverlay = "#define WITH_OVERLAY\n";

inline constexpr const char* kRealFragment = R"(
uniform sampler2D video;
#ifdef WITH_OVERLAY
uniform usampler2D labels;
uniform sampler2D palette;  // 256 x 1; alpha 0: nothing is known, the video stays as it is
#endif
out vec4 color;

void main() {
#ifdef WITH_WARP
  vec3 seen = real_pixel(vec2(0.0));
  ivec2 pixel = ivec2(seen.xy);
  vec3 shown = seen.z > 0.0 ? texelFetch(video, pixel, 0).rgb * real.z : vec3(0.0);
#else
  ivec2 pixel = ivec2(int(gl_FragCoord.x), int(picture.y) - 1 - int(gl_FragCoord.y));
  vec3 shown = texelFetch(video, pixel, 0).rgb * real.z;
#endif
#ifdef WITH_OVERLAY
  vec4 label = texelFetch(palette, ivec2(int(texelFetch(labels, pixel, 0).r), 0), 0);
#ifdef WITH_WARP
  label.a = seen.z > 0.0 ? label.a : 0.0;
#endif
  shown = mix(shown, label.rgb, label.a * real.x);
#endif
  color = vec4(shown, 1.0);
}
)";

}  // namespace tactus::render
