#include "pipeline/render/renderer.hpp"

#include <GLES3/gl3.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "pipeline/render/palette.hpp"
#include "pipeline/render/program.hpp"
#include "pipeline/render/shader_box.hpp"
#include "pipeline/render/shader_common.hpp"
#include "pipeline/render/shader_real.hpp"
#include "pipeline/render/shader_sphere.hpp"

namespace tactus::render {
namespace {

// 16 rows of 640 pixels are 40 KB: they stay in the L2 cache between GL's copy and ours.
constexpr int kRowsPerRead = 16;
constexpr GLuint kFrameBinding = 0;

struct CubeCorner {
  std::int8_t position[4];  // the fourth pads to GL's alignment
  std::int8_t face[4];
};
static_assert(sizeof(CubeCorner) == 8);
constexpr int kCubeCornerCount = 36;

/// Two triangles for each of the six faces.
constexpr std::array<CubeCorner, kCubeCornerCount> cube_corners() {
  constexpr std::int8_t kSquare[6][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, -1}, {1, 1}, {-1, 1}};
  std::array<CubeCorner, kCubeCornerCount> corners{};
  std::size_t next = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const std::int8_t side : {std::int8_t{-1}, std::int8_t{1}})
      for (const auto& square : kSquare) {
        CubeCorner& corner = corners[next++];
        corner.position[axis] = side;
        corner.position[(axis + 1) % 3] = square[0];
        corner.position[(axis + 2) % 3] = square[1];
        corner.face[axis] = side;
      }
  return corners;
}

const void* offset(std::size_t bytes) { return reinterpret_cast<const void*>(bytes); }

void describe_attribute(GLuint location, GLint components, GLenum type, bool is_normalised,
                        std::size_t stride_bytes, std::size_t offset_bytes, GLuint divisor) {
  glEnableVertexAttribArray(location);
  glVertexAttribPointer(location, components, type, is_normalised ? GL_TRUE : GL_FALSE,
                        static_cast<GLsizei>(stride_bytes), offset(offset_bytes));
  glVertexAttribDivisor(location, divisor);
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

rt::Error bad_usage(std::string message) { return {rt::ExitCode::bad_usage, std::move(message)}; }

}  // namespace

std::size_t Renderer::bytes_needed(const RenderConfig& config) {
  return rt::bytes_of<SphereInstance>(config.bodies_count_max) +
         rt::bytes_of<BoxInstance>(config.bodies_count_max) +
         rt::bytes_of<std::uint8_t>(static_cast<std::size_t>(config.camera.width) * 4 * kRowsPerRead);
}

Renderer::~Renderer() {
  glDeleteVertexArrays(kProgramCount, vertex_arrays_);
  glDeleteBuffers(kBufferCount, buffers_);
  glDeleteTextures(kTextureCount, textures_);
  for (const GLuint program : programs_) glDeleteProgram(program);
}

std::size_t Renderer::pixels_count() const {
  return static_cast<std::size_t>(config_.camera.width) * static_cast<std::size_t>(config_.camera.height);
}

rt::Result<void> Renderer::bind(const RenderConfig& config, rt::Slice slice) {
  TACTUS_ASSERT(programs_[kVideoProgram] == 0);
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
  if (!(config.toward_light_world.norm() > 0))
    return bad_usage("render: toward_light_world must not be zero");

  config_ = config;
  projection_ = projection_matrix(config.camera, config.clip);
  spheres_ = slice.take<SphereInstance>(config.bodies_count_max);
  boxes_ = slice.take<BoxInstance>(config.bodies_count_max);
  rgba_rows_ = slice.take<std::uint8_t>(static_cast<std::size_t>(config.camera.width) * 4 * kRowsPerRead);

  struct Source {
    const char* name;
    std::array<const char*, 2> vertex;
    std::array<const char*, 3> fragment;
  };
  const std::array<Source, kProgramCount> sources = {{
      {"video", {kShaderCommon, kRealVertex}, {kShaderCommon, kWithoutOverlay, kRealFragment}},
      {"video with overlay", {kShaderCommon, kRealVertex}, {kShaderCommon, kWithOverlay, kRealFragment}},
      {"sphere", {kShaderCommon, kSphereVertex}, {kShaderCommon, kShaderVirtual, kSphereFragment}},
      {"box", {kShaderCommon, kBoxVertex}, {kShaderCommon, kShaderVirtual, kBoxFragment}},
  }};
  for (std::size_t i = 0; i < kProgramCount; ++i) {
    const auto program = link_program(sources[i].name, sources[i].vertex, sources[i].fragment);
    if (!program) return program.error();
    programs_[i] = *program;
    glUseProgram(*program);
    glUniformBlockBinding(*program, glGetUniformBlockIndex(*program, "Frame"), kFrameBinding);
    // Each texture has the unit of its number; a program that does not use one has no such name, and -1 is
    // ignored.
    glUniform1i(glGetUniformLocation(*program, "video"), kVideoTexture);
    glUniform1i(glGetUniformLocation(*program, "real_depth_m"), kDepthTexture);
    glUniform1i(glGetUniformLocation(*program, "labels"), kLabelsTexture);
    glUniform1i(glGetUniformLocation(*program, "palette"), kPaletteTexture);
  }
  reserve_textures();
  reserve_buffers();
  if (take_errors() != rt::Status::ok)
    return rt::Error{rt::ExitCode::device_unavailable,
                     "render: the GLES driver has no memory for the pictures"};
  return {};
}

void Renderer::reserve_textures() {
  constexpr GLenum kFormats[kTextureCount] = {GL_RGB8, GL_R32F, GL_R8UI, GL_RGBA8};
  glGenTextures(kTextureCount, textures_);
  for (GLuint i = 0; i < kTextureCount; ++i) {
    glActiveTexture(GL_TEXTURE0 + i);
    glBindTexture(GL_TEXTURE_2D, textures_[i]);
    const bool is_image = i != kPaletteTexture;
    glTexStorage2D(GL_TEXTURE_2D, 1, kFormats[i], is_image ? config_.camera.width : 256,
                   is_image ? config_.camera.height : 1);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  }
  constexpr Palette kPalette = overlay_palette();
  glActiveTexture(GL_TEXTURE0 + kPaletteTexture);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 256, 1, GL_RGBA, GL_UNSIGNED_BYTE, kPalette.data());
}

void Renderer::reserve_buffers() {
  constexpr auto kCorners = cube_corners();
  glGenBuffers(kBufferCount, buffers_);
  glGenVertexArrays(kProgramCount, vertex_arrays_);

  glBindBuffer(GL_UNIFORM_BUFFER, buffers_[kFrameBuffer]);
  glBufferData(GL_UNIFORM_BUFFER, sizeof(FrameBlock), nullptr, GL_STREAM_DRAW);

  glBindVertexArray(vertex_arrays_[kSphereProgram]);
  glBindBuffer(GL_ARRAY_BUFFER, buffers_[kSphereBuffer]);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(spheres_.size_bytes()), nullptr, GL_STREAM_DRAW);
  constexpr std::size_t kSphere = sizeof(SphereInstance);
  describe_attribute(0, 4, GL_FLOAT, false, kSphere, offsetof(SphereInstance, rectangle_ndc), 1);
  describe_attribute(1, 4, GL_FLOAT, false, kSphere, offsetof(SphereInstance, center_depth_m), 1);
  describe_attribute(2, 4, GL_UNSIGNED_BYTE, true, kSphere, offsetof(SphereInstance, color), 1);

  glBindVertexArray(vertex_arrays_[kBoxProgram]);
  glBindBuffer(GL_ARRAY_BUFFER, buffers_[kCornerBuffer]);
  glBufferData(GL_ARRAY_BUFFER, sizeof(kCorners), kCorners.data(), GL_STATIC_DRAW);
  describe_attribute(0, 3, GL_BYTE, false, sizeof(CubeCorner), offsetof(CubeCorner, position), 0);
  describe_attribute(1, 3, GL_BYTE, false, sizeof(CubeCorner), offsetof(CubeCorner, face), 0);
  glBindBuffer(GL_ARRAY_BUFFER, buffers_[kBoxBuffer]);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(boxes_.size_bytes()), nullptr, GL_STREAM_DRAW);
  constexpr std::size_t kBox = sizeof(BoxInstance);
  for (GLuint axis = 0; axis < 3; ++axis)
    describe_attribute(2 + axis, 3, GL_FLOAT, false, kBox,
                       offsetof(BoxInstance, half_axes_depth_m) + axis * sizeof(Vec3f), 1);
  describe_attribute(5, 3, GL_FLOAT, false, kBox, offsetof(BoxInstance, center_depth_m), 1);
  describe_attribute(6, 4, GL_UNSIGNED_BYTE, true, kBox, offsetof(BoxInstance, color), 1);
}

rt::Result<void> Renderer::warm_up() {
  const std::vector<std::uint8_t> video(pixels_count() * 3, 128);
  const std::vector<float> depth_m(pixels_count(), 1.0F);
  const std::vector<MaterialId> labels(pixels_count(), 0);
  std::vector<std::uint8_t> rgb(pixels_count() * 3);
  const std::array<Body, 2> bodies = {Body{Shape::sphere, {}, {0.1F, 0.1F, 0.1F}, {-0.1, 0, 1}, {}},
                                      Body{Shape::box, {}, {0.1F, 0.1F, 0.1F}, {0.1, 0, 1}, {}}};
  RenderInputs inputs;
  inputs.video_rgb = video;
  inputs.depth_m = depth_m;
  inputs.bodies = bodies;
  for (const bool has_labels : {false, true}) {
    if (has_labels) inputs.labels = labels;
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

  InstanceCounts counts;
  if (has_pose)
    counts =
        build_instances(inputs.bodies, inputs.T_world_depth, config_.camera, config_.clip, spheres_, boxes_);
  upload_images(inputs, has_overlay, counts.spheres_count + counts.boxes_count > 0);
  upload_frame_block(inputs, has_overlay);
  draw(counts, has_overlay);

  const rt::Status status = take_errors();
  if (status != rt::Status::ok) return status;
  if (inputs.is_tracked && !has_pose) return rt::Status::lost;
  return counts.left_out_count > 0 ? rt::Status::full : rt::Status::ok;
}

void Renderer::upload_images(const RenderInputs& inputs, bool has_overlay, bool has_bodies) noexcept {
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
  if (has_bodies && !inputs.depth_m.empty()) {
    glActiveTexture(GL_TEXTURE0 + kDepthTexture);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RED, GL_FLOAT, inputs.depth_m.data());
  }
  if (has_overlay) {
    glActiveTexture(GL_TEXTURE0 + kLabelsTexture);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RED_INTEGER, GL_UNSIGNED_BYTE,
                    inputs.labels.data());
  }
}

void Renderer::upload_frame_block(const RenderInputs& inputs, bool has_overlay) noexcept {
  const hal::Intrinsics& camera = config_.camera;
  const Rotation depth_from_world = inputs.T_world_depth.rotation.transposed();
  FrameBlock block{};
  std::copy(projection_.begin(), projection_.end(), block.projection);
  store(block.pinhole, {camera.fx, camera.fy, camera.cx});
  block.pinhole[3] = static_cast<float>(camera.cy);
  block.picture[0] = static_cast<float>(camera.width);
  block.picture[1] = static_cast<float>(camera.height);
  block.picture[2] = config_.occlusion_bias_m;
  block.picture[3] = config_.occlusion_bias_per_m;
  store(block.toward_light, depth_from_world * config_.toward_light_world.normalized().cast<double>());
  store(block.up, depth_from_world * Vec3d{0, 1, 0});
  block.clip[0] = config_.clip.near_m;
  block.clip[1] = config_.clip.far_m;
  block.real[0] = has_overlay ? std::min(inputs.overlay_alpha, 1.0F) : 0.0F;
  block.real[1] = inputs.depth_m.empty() ? 0.0F : 1.0F;
  block.real[2] = inputs.video_rgb.empty() ? 0.0F : 1.0F;
  glBindBufferBase(GL_UNIFORM_BUFFER, kFrameBinding, buffers_[kFrameBuffer]);
  glBufferSubData(GL_UNIFORM_BUFFER, 0, sizeof(block), &block);
}

void Renderer::draw(const InstanceCounts& counts, bool has_overlay) noexcept {
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glDisable(GL_SCISSOR_TEST);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT);  // the first pass writes every pixel's colour

  glDisable(GL_DEPTH_TEST);
  glUseProgram(programs_[has_overlay ? kOverlayProgram : kVideoProgram]);
  glBindVertexArray(vertex_arrays_[kVideoProgram]);  // no attributes: corners come from their number
  glDrawArrays(GL_TRIANGLES, 0, 3);

  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  if (counts.boxes_count > 0) {
    glBindBuffer(GL_ARRAY_BUFFER, buffers_[kBoxBuffer]);
    glBufferSubData(GL_ARRAY_BUFFER, 0, static_cast<GLsizeiptr>(counts.boxes_count * sizeof(BoxInstance)),
                    boxes_.data());
    glUseProgram(programs_[kBoxProgram]);
    glBindVertexArray(vertex_arrays_[kBoxProgram]);
    glDrawArraysInstanced(GL_TRIANGLES, 0, kCubeCornerCount, static_cast<GLsizei>(counts.boxes_count));
  }
  if (counts.spheres_count > 0) {
    glBindBuffer(GL_ARRAY_BUFFER, buffers_[kSphereBuffer]);
    glBufferSubData(GL_ARRAY_BUFFER, 0,
                    static_cast<GLsizeiptr>(counts.spheres_count * sizeof(SphereInstance)), spheres_.data());
    glUseProgram(programs_[kSphereProgram]);
    glBindVertexArray(vertex_arrays_[kSphereProgram]);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(counts.spheres_count));
  }
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
