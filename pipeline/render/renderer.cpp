#include "pipeline/render/renderer.hpp"

#include <GLES3/gl3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "pipeline/render/font.hpp"
#include "pipeline/render/palette.hpp"
#include "pipeline/render/program.hpp"
#include "pipeline/render/shader_common.hpp"
#include "pipeline/render/shader_decal.hpp"
#include "pipeline/render/shader_mesh.hpp"
#include "pipeline/render/shader_real.hpp"
#include "pipeline/render/shader_shadow.hpp"
#include "pipeline/render/shader_sphere.hpp"
#include "pipeline/render/shader_text.hpp"

namespace tactus::render {
namespace {

// 16 rows of 640 pixels are 40 KB: they stay in the L2 cache between GL's copy and ours.
constexpr int kRowsPerRead = 16;
constexpr GLuint kFrameBinding = 0;

const void* offset(std::size_t bytes) { return reinterpret_cast<const void*>(bytes); }

void describe_attribute(GLuint location, GLint components, GLenum type, bool is_normalised,
                        std::size_t stride_bytes, std::size_t offset_bytes, GLuint divisor) {
  glEnableVertexAttribArray(location);
  glVertexAttribPointer(location, components, type, is_normalised ? GL_TRUE : GL_FALSE,
                        static_cast<GLsizei>(stride_bytes), offset(offset_bytes));
  glVertexAttribDivisor(location, divisor);
}

void describe_mesh_vertices() {
  constexpr std::size_t kVertex = sizeof(MeshVertex);
  describe_attribute(0, 3, GL_FLOAT, false, kVertex, offsetof(MeshVertex, position), 0);
  describe_attribute(1, 3, GL_FLOAT, false, kVertex, offsetof(MeshVertex, normal), 0);
  describe_attribute(2, 1, GL_FLOAT, false, kVertex, offsetof(MeshVertex, cap), 0);
}

/// From one instance on: GLES 3.0 has no first instance in its draw calls.
void describe_mesh_instances(std::size_t first) {
  constexpr std::size_t kMesh = sizeof(MeshInstance);
  const std::size_t start = first * kMesh + offsetof(MeshInstance, half_axes_depth_m);
  for (GLuint axis = 0; axis < 3; ++axis)
    describe_attribute(3 + axis, 3, GL_FLOAT, false, kMesh, start + axis * sizeof(Vec3f), 1);
  describe_attribute(6, 4, GL_FLOAT, false, kMesh, first * kMesh + offsetof(MeshInstance, center_depth_m), 1);
  describe_attribute(7, 4, GL_UNSIGNED_BYTE, true, kMesh, first * kMesh + offsetof(MeshInstance, color), 1);
  describe_attribute(8, 4, GL_UNSIGNED_BYTE, true, kMesh, first * kMesh + offsetof(MeshInstance, finish), 1);
}

void describe_decal_instances(std::size_t first) {
  constexpr std::size_t kDecal = sizeof(DecalInstance);
  const auto at = [first](std::size_t member) { return first * kDecal + member; };
  describe_attribute(0, 4, GL_FLOAT, false, kDecal, at(offsetof(DecalInstance, rectangle_ndc)), 1);
  describe_attribute(1, 4, GL_FLOAT, false, kDecal, at(offsetof(DecalInstance, center_depth_m)), 1);
  describe_attribute(2, 3, GL_FLOAT, false, kDecal, at(offsetof(DecalInstance, axis_x_depth)), 1);
  describe_attribute(3, 3, GL_FLOAT, false, kDecal, at(offsetof(DecalInstance, axis_y_depth)), 1);
  describe_attribute(4, 4, GL_UNSIGNED_BYTE, true, kDecal, at(offsetof(DecalInstance, tint)), 1);
  glEnableVertexAttribArray(5);
  glVertexAttribIPointer(5, 1, GL_UNSIGNED_INT, static_cast<GLsizei>(kDecal),
                         offset(at(offsetof(DecalInstance, seed))));
  glVertexAttribDivisor(5, 1);
}

void store(float (&out)[4], const Vec3f& v) {
  out[0] = v.x;
  out[1] = v.y;
  out[2] = v.z;
}

void store(float (&out)[4], const Vec3d& v) {
  out[0] = static_cast<float>(v.x);
  out[1] = static_cast<float>(v.y);
  out[2] = static_cast<float>(v.z);
}

/// A wrong enum or value is our bug; anything else means that the device does not draw any more.
rt::Status take_errors() {
  const GLenum error = glGetError();
  TACTUS_ASSERT(error != GL_INVALID_ENUM && error != GL_INVALID_VALUE && error != GL_INVALID_OPERATION);
  return error == GL_NO_ERROR ? rt::Status::ok : rt::Status::device_lost;
}

bool is_finite(const Vec3f& v) { return std::isfinite(v.x + v.y + v.z); }

Light usable(const Light& light) {
  const bool is_usable = is_finite(light.toward_world) && light.toward_world.norm() > 0 &&
                         is_finite(light.color) && is_finite(light.ambient_up) &&
                         is_finite(light.ambient_down);
  return is_usable ? light : Light{};
}

/// K R K^-1, so that pixel_video ~ H (u, v, 1); its third coordinate is the depth that a point of depth 1 in
/// the picture has in the video's camera.
std::array<Vec3d, 3> homography_columns(const Rotation& R_video_picture, const hal::Intrinsics& camera) {
  const auto through = [&](const Vec3d& ray) {
    const Vec3d d = R_video_picture * ray;
    return Vec3d{camera.fx * d.x + camera.cx * d.z, camera.fy * d.y + camera.cy * d.z, d.z};
  };
  return {through({1 / camera.fx, 0, 0}), through({0, 1 / camera.fy, 0}),
          through({-camera.cx / camera.fx, -camera.cy / camera.fy, 1})};
}

rt::Error bad_usage(std::string message) { return {rt::ExitCode::bad_usage, std::move(message)}; }

}  // namespace

std::size_t Renderer::bytes_needed(const RenderConfig& config) {
  return rt::bytes_of<SphereInstance>(config.bodies_count_max) +
         rt::bytes_of<MeshInstance>(config.bodies_count_max) +
         rt::bytes_of<Caster>(2 * config.bodies_count_max) + rt::bytes_of<DecalInstance>(kDecalsMax) +
         rt::bytes_of<GlyphInstance>(kGlyphInstancesMax) + rt::bytes_of<float>(config.hulls.size()) +
         rt::bytes_of<std::uint8_t>(static_cast<std::size_t>(config.camera.width) * 4 * kRowsPerRead);
}

Renderer::~Renderer() {
  glDeleteVertexArrays(kVertexArrayCount, vertex_arrays_);
  glDeleteBuffers(kBufferCount, buffers_);
  glDeleteFramebuffers(1, &shadow_framebuffer_);
  glDeleteTextures(kTextureCount, textures_);
  for (const auto& variants : programs_)
    for (const GLuint program : variants) glDeleteProgram(program);
}

std::size_t Renderer::pixels_count() const {
  return static_cast<std::size_t>(config_.camera.width) * static_cast<std::size_t>(config_.camera.height);
}

rt::Result<void> Renderer::bind(const RenderConfig& config, rt::Slice slice) {
  TACTUS_ASSERT(programs_[kVideoProgram][0] == 0);
  if (glGetString(GL_VERSION) == nullptr)
    return rt::Error{rt::ExitCode::device_unavailable,
                     "render: no GLES context is current on this thread; open a display first"};
  if (config.camera.has_distortion())
    return bad_usage(
        "render: the picture's camera has distortion; give it undistorted images and their intrinsics");
  GLint size_max = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &size_max);
  if (config.camera.width < 1 || config.camera.height < 1 || config.camera.width > size_max ||
      config.camera.height > size_max || !(config.camera.fx > 0) || !(config.camera.fy > 0))
    return bad_usage("render: a camera of " + std::to_string(config.camera.width) + " x " +
                     std::to_string(config.camera.height) +
                     " pixels cannot be shown; this driver takes 1 to " + std::to_string(size_max) +
                     " pixels each way, and focal lengths must be positive");
  if (!(config.clip.near_m > 0) || !(config.clip.far_m > config.clip.near_m))
    return bad_usage("render: the clip range must be 0 < near < far (metres)");
  if (config.bodies_count_max < 1) return bad_usage("render: bodies_count_max must be at least 1");
  const auto meshes = build_meshes(config.hulls);
  if (!meshes) return meshes.error();

  config_ = config;
  config_.hulls = {};
  projection_ = projection_matrix(config.camera, config.clip);
  spheres_ = slice.take<SphereInstance>(config.bodies_count_max);
  meshes_ = slice.take<MeshInstance>(config.bodies_count_max);
  casters_ = slice.take<Caster>(2 * config.bodies_count_max);
  decals_ = slice.take<DecalInstance>(kDecalsMax);
  glyphs_ = slice.take<GlyphInstance>(kGlyphInstancesMax);
  hull_radii_m_ = slice.take<float>(config.hulls.size());
  rgba_rows_ = slice.take<std::uint8_t>(static_cast<std::size_t>(config.camera.width) * 4 * kRowsPerRead);
  std::transform(config.hulls.begin(), config.hulls.end(), hull_radii_m_.begin(), radius_of);
  std::copy(meshes->ranges.begin(), meshes->ranges.end(), mesh_ranges_.begin());

  if (auto linked = link_programs(); !linked) return linked.error();
  if (auto reserved = reserve_textures(); !reserved) return reserved.error();
  reserve_buffers(*meshes);
  if (take_errors() != rt::Status::ok)
    return rt::Error{rt::ExitCode::device_unavailable,
                     "render: the GLES driver has no memory for the pictures"};
  return {};
}

rt::Result<void> Renderer::link_programs() {
  struct Source {
    const char* name;
    bool has_warp;  // reads the real images, which may be turned
    std::array<const char*, 3> vertex;
    std::array<const char*, 5> fragment;
  };
  const auto decal = [](DecalKind kind) {
    const auto i = static_cast<std::size_t>(kind);
    return Source{kDecalKindNames[i].data(),
                  true,
                  {kDecalVertex, "", ""},
                  {kShaderReal, kShaderRealDepth, kDecalNoise, kDecalMarks[i], kDecalFragment}};
  };
  const std::array<Source, kProgramCount> sources = {{
      {"video", true, {kRealVertex, "", ""}, {kShaderReal, kRealFragment, "", "", ""}},
      {"video with overlay", true, {kRealVertex, "", ""}, {kWithOverlay, kShaderReal, kRealFragment, "", ""}},
      {"sphere",
       true,
       {kSphereAttributes, kSphereVertex, ""},
       {kShaderReal, kShaderRealDepth, kShaderShadow, kShaderVirtual, kSphereFragment}},
      {"mesh",
       true,
       {kMeshAttributes, kMeshVertex, ""},
       {kShaderReal, kShaderRealDepth, kShaderShadow, kShaderVirtual, kMeshFragment}},
      {"shadow on the real",
       true,
       {kShadeVertex, "", ""},
       {kShaderReal, kShaderRealDepth, kShaderShadow, kShadeFragment, ""}},
      decal(DecalKind::crater),
      decal(DecalKind::cracks),
      decal(DecalKind::tear),
      decal(DecalKind::splinter),
      decal(DecalKind::dent),
      {"shadow of a sphere",
       false,
       {kSphereAttributes, kCastSphereVertex, ""},
       {kCastSphereFragment, "", "", "", ""}},
      {"shadow of a mesh",
       false,
       {kMeshAttributes, kCastMeshVertex, ""},
       {kCastMeshFragment, "", "", "", ""}},
      {"text", false, {kTextVertex, "", ""}, {kTextFragment, "", "", "", ""}},
  }};
  constexpr std::pair<const char*, GLint> kSamplers[] = {
      {"video", kVideoTexture},     {"real_depth_m", kDepthTexture}, {"labels", kLabelsTexture},
      {"palette", kPaletteTexture}, {"shadow_map", kShadowTexture},  {"font", kFontTexture}};
  for (std::size_t i = 0; i < kProgramCount; ++i)
    for (std::size_t warp = 0; warp < (sources[i].has_warp ? 2 : 1); ++warp) {
      const auto& vertex = sources[i].vertex;
      const auto& fragment = sources[i].fragment;
      const char* const define = warp == 1 ? kWithWarp : kWithoutWarp;
      const std::array<const char*, 4> vertex_pieces = {kShaderCommon, vertex[0], vertex[1], vertex[2]};
      const std::array<const char*, 7> fragment_pieces = {
          kShaderCommon, define, fragment[0], fragment[1], fragment[2], fragment[3], fragment[4]};
      const auto program = link_program(sources[i].name, vertex_pieces, fragment_pieces);
      if (!program) return program.error();
      programs_[i][warp] = *program;
      glUseProgram(*program);
      const GLuint block = glGetUniformBlockIndex(*program, "Frame");
      if (block != GL_INVALID_INDEX) glUniformBlockBinding(*program, block, kFrameBinding);
      // Each texture has the unit of its number; a program that does not use one has no such name, and -1 is
      // ignored.
      for (const auto& [name, unit] : kSamplers) glUniform1i(glGetUniformLocation(*program, name), unit);
    }
  return {};
}

rt::Result<void> Renderer::reserve_textures() {
  constexpr GLenum kFormats[kTextureCount] = {GL_RGB8, GL_R32F, GL_R8UI, GL_RGBA8, GL_DEPTH_COMPONENT16,
                                              GL_R8};
  const GLsizei width = config_.camera.width, height = config_.camera.height;
  const GLsizei sizes[kTextureCount][2] = {{width, height},
                                           {width, height},
                                           {width, height},
                                           {256, 1},
                                           {kShadowMapPixels, kShadowMapPixels},
                                           {kGlyphsCount * kGlyphWidth, kGlyphHeight}};
  glGenTextures(kTextureCount, textures_);
  for (GLuint i = 0; i < kTextureCount; ++i) {
    glActiveTexture(GL_TEXTURE0 + i);
    glBindTexture(GL_TEXTURE_2D, textures_[i]);
    glTexStorage2D(GL_TEXTURE_2D, 1, kFormats[i], sizes[i][0], sizes[i][1]);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  }
  constexpr Palette kPalette = overlay_palette();
  glActiveTexture(GL_TEXTURE0 + kPaletteTexture);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 256, 1, GL_RGBA, GL_UNSIGNED_BYTE, kPalette.data());

  std::vector<std::uint8_t> font;
  for (int y = 0; y < kGlyphHeight; ++y)
    for (int x = 0; x < kGlyphsCount * kGlyphWidth; ++x)
      font.push_back(glyph_ink(static_cast<char>(kGlyphFirst + x / kGlyphWidth), x % kGlyphWidth, y) ? 255
                                                                                                     : 0);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glActiveTexture(GL_TEXTURE0 + kFontTexture);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, kGlyphsCount * kGlyphWidth, kGlyphHeight, GL_RED, GL_UNSIGNED_BYTE,
                  font.data());

  // Compared while it is read, and the four answers blended: edges are a texel wide.
  glActiveTexture(GL_TEXTURE0 + kShadowTexture);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);

  GLint picture = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &picture);
  glGenFramebuffers(1, &shadow_framebuffer_);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, shadow_framebuffer_);
  glFramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, textures_[kShadowTexture],
                         0);
  const bool is_complete = glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  glDepthMask(GL_TRUE);
  if (is_complete) glClear(GL_DEPTH_BUFFER_BIT);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(picture));
  if (!is_complete)
    return rt::Error{
        rt::ExitCode::device_unavailable,
        "render: the GLES driver does not draw into a 512 x 512 depth texture, which shadows need"};
  return {};
}

void Renderer::reserve_buffers(const MeshSet& meshes) {
  glGenBuffers(kBufferCount, buffers_);
  glGenVertexArrays(kVertexArrayCount, vertex_arrays_);
  const auto reserve = [this](GLenum target, Buffer buffer, std::size_t bytes, const void* data) {
    glBindBuffer(target, buffers_[buffer]);
    glBufferData(target, static_cast<GLsizeiptr>(bytes), data,
                 data == nullptr ? GL_STREAM_DRAW : GL_STATIC_DRAW);
  };
  reserve(GL_UNIFORM_BUFFER, kFrameBuffer, sizeof(FrameBlock), nullptr);

  glBindVertexArray(vertex_arrays_[kSphereVertices]);
  reserve(GL_ARRAY_BUFFER, kSphereBuffer, spheres_.size_bytes(), nullptr);
  constexpr std::size_t kSphere = sizeof(SphereInstance);
  describe_attribute(0, 4, GL_FLOAT, false, kSphere, offsetof(SphereInstance, rectangle_ndc), 1);
  describe_attribute(1, 4, GL_FLOAT, false, kSphere, offsetof(SphereInstance, center_depth_m), 1);
  describe_attribute(2, 4, GL_UNSIGNED_BYTE, true, kSphere, offsetof(SphereInstance, color), 1);
  describe_attribute(3, 4, GL_UNSIGNED_BYTE, true, kSphere, offsetof(SphereInstance, finish), 1);

  glBindVertexArray(vertex_arrays_[kMeshVertices]);
  reserve(GL_ELEMENT_ARRAY_BUFFER, kIndexBuffer, meshes.indices.size() * sizeof(std::uint16_t),
          meshes.indices.data());
  reserve(GL_ARRAY_BUFFER, kVertexBuffer, meshes.vertices.size() * sizeof(MeshVertex),
          meshes.vertices.data());
  describe_mesh_vertices();
  reserve(GL_ARRAY_BUFFER, kMeshBuffer, meshes_.size_bytes(), nullptr);
  describe_mesh_instances(0);

  glBindVertexArray(vertex_arrays_[kPrismVertices]);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers_[kIndexBuffer]);
  glBindBuffer(GL_ARRAY_BUFFER, buffers_[kVertexBuffer]);
  describe_attribute(0, 3, GL_FLOAT, false, sizeof(MeshVertex), offsetof(MeshVertex, position), 0);
  reserve(GL_ARRAY_BUFFER, kCasterBuffer, casters_.size_bytes(), nullptr);
  describe_attribute(1, 4, GL_FLOAT, false, sizeof(Caster), offsetof(Caster, center_depth_m), 1);
  describe_attribute(2, 2, GL_FLOAT, false, sizeof(Caster), offsetof(Caster, sweep_begin_m), 1);

  glBindVertexArray(vertex_arrays_[kDecalVertices]);
  reserve(GL_ARRAY_BUFFER, kDecalBuffer, decals_.size_bytes(), nullptr);
  describe_decal_instances(0);

  glBindVertexArray(vertex_arrays_[kGlyphVertices]);
  reserve(GL_ARRAY_BUFFER, kGlyphBuffer, glyphs_.size_bytes(), nullptr);
  constexpr std::size_t kGlyph = sizeof(GlyphInstance);
  describe_attribute(0, 4, GL_SHORT, false, kGlyph, offsetof(GlyphInstance, rectangle_px), 1);
  describe_attribute(1, 4, GL_UNSIGNED_BYTE, false, kGlyph, offsetof(GlyphInstance, color_glyph), 1);
  glBindVertexArray(0);
}

rt::Result<void> Renderer::warm_up() {
  const std::vector<std::uint8_t> video(pixels_count() * 3, 128);
  const std::vector<float> depth_m(pixels_count(), 1.0F);
  const std::vector<MaterialId> labels(pixels_count(), 0);
  std::vector<std::uint8_t> rgb(pixels_count() * 3);
  std::array<Body, 2> bodies;
  bodies[0] = {Shape::sphere, {}, {0.1F, 0.1F, 0.1F}, {-0.1, 0, 0.5}, {}};
  bodies[1] = {Shape::box, {}, {0.1F, 0.1F, 0.1F}, {0.1, 0, 0.5}, {}};
  std::array<Decal, kDecalKindsCount> decals;
  for (std::size_t i = 0; i < decals.size(); ++i)
    decals[i] = {static_cast<DecalKind>(i), {0, 0, 1}, {0, 0, -1}, 0.1F, {}, 1};
  RenderInputs inputs;
  inputs.video_rgb = video;
  inputs.depth_m = depth_m;
  inputs.bodies = bodies;
  inputs.decals = decals;
  const std::array<TextLine, 1> text = {TextLine{"?", 0, 0, {}, 1}};
  inputs.text = text;
  for (const bool has_labels : {false, true})
    for (const double turn : {0.0, 0.01}) {
      if (has_labels) inputs.labels = labels;
      inputs.R_video_picture = Rotation::from(Quaternion{1, turn, 0, 0}.normalized());
      if (step(inputs) != rt::Status::ok || read_back(rgb) != rt::Status::ok)
        return rt::Error{
            rt::ExitCode::device_unavailable,
            "render: the first picture could not be drawn; is the framebuffer of a display bound?"};
    }
  return {};
}

rt::Status Renderer::step(const RenderInputs& inputs) noexcept {
  TACTUS_ASSERT(inputs.video_rgb.empty() || inputs.video_rgb.size() == pixels_count() * 3);
  TACTUS_ASSERT(inputs.depth_m.empty() || inputs.depth_m.size() == pixels_count());
  TACTUS_ASSERT(inputs.labels.empty() || inputs.labels.size() == pixels_count());
  const bool has_overlay = !inputs.labels.empty() && inputs.overlay_alpha > 0;
  const bool has_pose = inputs.is_tracked && inputs.T_world_depth.is_finite();

  const bool has_warp = inputs.R_video_picture.m != Rotation{}.m;
  const bool has_depth = !inputs.depth_m.empty();

  InstanceCounts counts;
  if (has_pose)
    counts = build_instances(inputs.bodies, inputs.T_world_depth, config_.camera, config_.clip, hull_radii_m_,
                             spheres_, meshes_, casters_);
  DecalCounts decal_counts;
  if (has_pose && has_depth)
    decal_counts = build_decals(inputs.decals, inputs.T_world_depth, config_.camera, config_.clip, decals_);
  if (!inputs.has_shadows) counts.casters_count = 0;
  const bool has_shadows = counts.casters_count > 0;
  const Light light = usable(inputs.light);
  const auto casters = casters_.first(counts.casters_count);
  const ShadowView shadow = fit_shadow(casters, inputs.T_world_depth, light.toward_world);
  if (has_shadows) {
    const Vec3d toward =
        inputs.T_world_depth.rotation.transposed() * light.toward_world.cast<double>().normalized();
    counts.casters_count = has_depth ? find_sweeps(inputs.depth_m, config_.camera, inputs.R_video_picture,
                                                   toward.cast<float>(), shadow.axis_x_depth, casters)
                                     : 0;
  }
  upload_images(inputs, has_overlay,
                has_depth && counts.in_view_count + counts.casters_count + decal_counts.total_count > 0);
  upload_frame_block(inputs, light, shadow, has_overlay);
  upload_instances(counts, decal_counts);

  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glDisable(GL_SCISSOR_TEST);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  if (has_shadows) draw_shadow_map(counts);

  glClear(GL_DEPTH_BUFFER_BIT);  // the video writes every pixel's colour
  glDisable(GL_DEPTH_TEST);
  use(has_overlay ? kOverlayProgram : kVideoProgram, kNoVertices, has_warp);
  glDrawArrays(GL_TRIANGLES, 0, 3);  // no attributes: corners come from their number
  if (decal_counts.total_count > 0) draw_decals(decal_counts, has_warp);
  glEnable(GL_DEPTH_TEST);
  if (counts.casters_count > 0) draw_shadows(counts, has_warp);
  if (counts.in_view_count > 0) draw_bodies(counts, has_depth, has_warp);
  draw_text(build_text(inputs.text, inputs.crosshair, config_.camera.width, config_.camera.height, glyphs_));
  glBindVertexArray(0);

  const rt::Status status = take_errors();
  if (status != rt::Status::ok) return status;
  if (inputs.is_tracked && !has_pose) return rt::Status::lost;
  return counts.left_out_count > 0 ? rt::Status::full : rt::Status::ok;
}

void Renderer::upload_images(const RenderInputs& inputs, bool has_overlay, bool has_depth) noexcept {
  const GLsizei width = config_.camera.width, height = config_.camera.height;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  for (GLuint i = 0; i < kTextureCount; ++i) {
    glActiveTexture(GL_TEXTURE0 + i);
    glBindTexture(GL_TEXTURE_2D, textures_[i]);
  }
  if (!inputs.video_rgb.empty()) {
    glActiveTexture(GL_TEXTURE0 + kVideoTexture);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, inputs.video_rgb.data());
  }
  if (has_depth) {
    glActiveTexture(GL_TEXTURE0 + kDepthTexture);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RED, GL_FLOAT, inputs.depth_m.data());
  }
  if (has_overlay) {
    glActiveTexture(GL_TEXTURE0 + kLabelsTexture);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RED_INTEGER, GL_UNSIGNED_BYTE,
                    inputs.labels.data());
  }
}

void Renderer::upload_frame_block(const RenderInputs& inputs, const Light& light, const ShadowView& shadow,
                                  bool has_overlay) noexcept {
  const hal::Intrinsics& camera = config_.camera;
  const Rotation depth_from_world = inputs.T_world_depth.rotation.transposed();
  FrameBlock block{};
  std::copy(projection_.begin(), projection_.end(), block.projection);
  std::copy(shadow.shadow_from_depth.begin(), shadow.shadow_from_depth.end(), block.shadow);
  const auto columns = homography_columns(inputs.R_video_picture, camera);
  for (std::size_t i = 0; i < columns.size(); ++i) store(block.homography[i], columns[i]);
  store(block.pinhole, Vec3d{camera.fx, camera.fy, camera.cx});
  block.pinhole[3] = static_cast<float>(camera.cy);
  block.picture[0] = static_cast<float>(camera.width);
  block.picture[1] = static_cast<float>(camera.height);
  block.picture[2] = config_.occlusion_bias_m;
  block.picture[3] = config_.occlusion_bias_per_m;
  store(block.toward_light, depth_from_world * light.toward_world.cast<double>().normalized());
  store(block.light_x, shadow.axis_x_depth);
  store(block.up, depth_from_world * Vec3d{0, 1, 0});
  store(block.light_color, light.color);
  store(block.ambient_up, light.ambient_up);
  store(block.ambient_down, light.ambient_down);
  block.clip[0] = config_.clip.near_m;
  block.clip[1] = config_.clip.far_m;
  block.clip[3] = shadow.texel_m;
  block.real[0] = has_overlay ? std::min(inputs.overlay_alpha, 1.0F) : 0.0F;
  block.real[1] = inputs.depth_m.empty() ? 0.0F : 1.0F;
  block.real[2] = inputs.video_rgb.empty() ? 0.0F : 1.0F;
  glBindBufferBase(GL_UNIFORM_BUFFER, kFrameBinding, buffers_[kFrameBuffer]);
  glBufferSubData(GL_UNIFORM_BUFFER, 0, sizeof(block), &block);
}

void Renderer::upload_instances(const InstanceCounts& counts, const DecalCounts& decal_counts) noexcept {
  const auto upload = [this](Buffer buffer, auto instances) {
    if (instances.empty()) return;
    glBindBuffer(GL_ARRAY_BUFFER, buffers_[buffer]);
    glBufferSubData(GL_ARRAY_BUFFER, 0, static_cast<GLsizeiptr>(instances.size_bytes()), instances.data());
  };
  const InstanceCounts::Run& last = counts.meshes.back();
  upload(kSphereBuffer, spheres_.first(counts.spheres.count));
  upload(kMeshBuffer, meshes_.first(last.first + last.count));
  upload(kCasterBuffer, casters_.first(counts.casters_count));
  upload(kDecalBuffer, decals_.first(decal_counts.total_count));
}

void Renderer::use(Program program, VertexArray vertices, bool has_warp) noexcept {
  glUseProgram(programs_[program][has_warp ? 1 : 0]);
  glBindVertexArray(vertex_arrays_[vertices]);
}

void Renderer::draw_meshes(const InstanceCounts& counts, bool in_view_only) noexcept {
  glBindBuffer(GL_ARRAY_BUFFER, buffers_[kMeshBuffer]);
  for (std::size_t mesh = 0; mesh < kMeshesMax; ++mesh) {
    const InstanceCounts::Run& run = counts.meshes[mesh];
    const std::size_t count = in_view_only ? run.in_view_count : run.count;
    if (count == 0) continue;
    describe_mesh_instances(run.first);
    glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(mesh_ranges_[mesh].indices_count),
                            GL_UNSIGNED_SHORT, offset(mesh_ranges_[mesh].first_index * sizeof(std::uint16_t)),
                            static_cast<GLsizei>(count));
  }
}

void Renderer::draw_decals(const DecalCounts& counts, bool has_warp) noexcept {
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  for (std::size_t kind = 1; kind < kDecalKindsCount; ++kind) {
    if (counts.count[kind] == 0) continue;
    use(static_cast<Program>(kCraterProgram + kind - 1), kDecalVertices, has_warp);
    glBindBuffer(GL_ARRAY_BUFFER, buffers_[kDecalBuffer]);
    describe_decal_instances(counts.first[kind]);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(counts.count[kind]));
  }
  glDisable(GL_BLEND);
}

void Renderer::draw_shadow_map(const InstanceCounts& counts) noexcept {
  GLint picture = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &picture);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, shadow_framebuffer_);
  glViewport(0, 0, kShadowMapPixels, kShadowMapPixels);
  glClear(GL_DEPTH_BUFFER_BIT);
  if (counts.spheres.count > 0) {
    use(kCastSphereProgram, kSphereVertices);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(counts.spheres.count));
  }
  use(kCastMeshProgram, kMeshVertices);
  draw_meshes(counts, false);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(picture));
  glViewport(0, 0, config_.camera.width, config_.camera.height);
}

void Renderer::draw_shadows(const InstanceCounts& counts, bool has_warp) noexcept {
  glEnable(GL_BLEND);
  glBlendFunc(GL_ZERO, GL_SRC_COLOR);
  glEnable(GL_CULL_FACE);
  glCullFace(GL_FRONT);
  use(kShadeProgram, kPrismVertices, has_warp);
  glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(mesh_ranges_[kBoxMesh].indices_count),
                          GL_UNSIGNED_SHORT,
                          offset(mesh_ranges_[kBoxMesh].first_index * sizeof(std::uint16_t)),
                          static_cast<GLsizei>(counts.casters_count));
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
}

void Renderer::draw_bodies(const InstanceCounts& counts, bool has_depth, bool has_warp) noexcept {
  if (has_depth) {  // else nothing hides, and every pixel is opaque
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  }
  use(kMeshProgram, kMeshVertices, has_warp);
  draw_meshes(counts, true);
  if (counts.spheres.in_view_count > 0) {
    use(kSphereProgram, kSphereVertices, has_warp);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(counts.spheres.in_view_count));
  }
  glDisable(GL_BLEND);
}

void Renderer::draw_text(std::size_t count) noexcept {
  if (count == 0) return;
  glBindBuffer(GL_ARRAY_BUFFER, buffers_[kGlyphBuffer]);
  glBufferSubData(GL_ARRAY_BUFFER, 0, static_cast<GLsizeiptr>(count * sizeof(GlyphInstance)), glyphs_.data());
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  use(kTextProgram, kGlyphVertices);
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(count));
  glDisable(GL_BLEND);
}

rt::Status Renderer::read_back(std::span<std::uint8_t> rgb) noexcept {
  TACTUS_ASSERT(rgb.size() == pixels_count() * 3);
  const int width = config_.camera.width, height = config_.camera.height;
  const auto row_pixels_count = static_cast<std::size_t>(width);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  for (int gl_row = 0; gl_row < height; gl_row += kRowsPerRead) {
    const int rows_count = std::min(kRowsPerRead, height - gl_row);
    glReadPixels(0, gl_row, width, rows_count, GL_RGBA, GL_UNSIGNED_BYTE, rgba_rows_.data());
    for (int i = 0; i < rows_count; ++i) {
      const std::uint8_t* from = rgba_rows_.data() + static_cast<std::size_t>(i) * row_pixels_count * 4;
      std::uint8_t* to =
          rgb.data() + static_cast<std::size_t>(height - 1 - gl_row - i) * row_pixels_count * 3;
      for (std::size_t x = 0; x < row_pixels_count; ++x) {
        to[3 * x] = from[4 * x];
        to[3 * x + 1] = from[4 * x + 1];
        to[3 * x + 2] = from[4 * x + 2];
      }
    }
  }
  return take_errors();
}

}  // namespace tactus::render
