// Cells of text: ink in the line's colour, the rest of the cell darkens what lies behind.
#pragma once

namespace tactus::render {

inline constexpr const char* kTextVertex = R"(
layout(location = 0) in vec4 rectangle_px;
layout(location = 1) in vec4 color_glyph;  // 0 to 255
out vec2 within;                           // 0 to 1 from the cell's left upper corner
flat out vec3 ink;
flat out int glyph;

void main() {
  within = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  vec2 place = (rectangle_px.xy + within * rectangle_px.zw) / picture.xy;
  gl_Position = vec4(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, 0.0, 1.0);
  ink = color_glyph.rgb / 255.0;
  glyph = int(color_glyph.a);
}
)";

inline constexpr const char* kTextFragment = R"(
uniform sampler2D font;  // all glyphs side by side, 6 x 10 each
in vec2 within;
flat in vec3 ink;
flat in int glyph;
out vec4 color;

void main() {
  ivec2 pixel = min(ivec2(within * vec2(6.0, 10.0)), ivec2(5, 9));
  bool is_ink = glyph == 255 || texelFetch(font, pixel + ivec2(6 * min(glyph, 94), 0), 0).r > 0.5;
  color = is_ink ? vec4(ink, 1.0) : vec4(0.0, 0.0, 0.0, 0.55);
}
)";

}  // namespace tactus::render
