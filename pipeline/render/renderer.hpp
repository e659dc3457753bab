// Draws one picture: the camera's video, marks on real surfaces, and virtual bodies that real things hide.
//
// Two layers (Chen et al. 2018, section IV-E): the video behind, and in front of it the real surfaces,
// invisible, which hide what is behind them. The real surfaces are the registered depth image of the same
// camera and the same moment.
//
//   passes   shadow map; video and label overlay; decals; shadows on the real; bodies; text
//
//   inputs   video, depth, labels, pose, light, bodies, decals, text; images in the camera given at bind
//
//   output   the framebuffer bound by hal::Display::begin(); read_back() copies it into memory
//
//   memory   what bytes_needed() says, and the driver's own, which cannot be fenced (see resident.hpp)
//
//   late     the caller drops the picture; nothing is carried over from one step to the next
//
//   full     more bodies in view than bodies_count_max: the first ones are drawn
//
//   lost     without a pose the video and the text are shown, virtual things are not
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/calibration.hpp"
#include "pipeline/label/material.hpp"
#include "pipeline/render/body.hpp"
#include "pipeline/render/camera.hpp"
#include "pipeline/render/decal.hpp"
#include "pipeline/render/light.hpp"
#include "pipeline/render/mesh.hpp"
#include "pipeline/render/shadow.hpp"
#include "pipeline/render/text.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::render {

struct RenderConfig {
  hal::Intrinsics camera;  // of the video and of the depth image; no distortion; also the size of the picture
  std::size_t bodies_count_max = 256;  // of spheres, and of all other shapes together
  std::span<const HullMesh> hulls;     // the shapes of Body::hull_index; read at bind only
  ClipRange clip;
  /// A virtual point at depth z is hidden by a real one nearer than z - (bias_m + bias_per_m z^2). 2 sigma of
  /// a Kinect v1 (1.425 mm z^2, Khoshelham and Elberink 2012) and half a voxel, so that a ball on a table is
  /// not eaten from below.
  float occlusion_bias_m = 0.005F;
  float occlusion_bias_per_m = 0.00285F;
};

struct RenderInputs {
  std::span<const std::uint8_t> video_rgb;  // width * height * 3, row-major; empty: black
  std::span<const float> depth_m;      // width * height, 0 or NaN: no measurement; empty: nothing real hides
  std::span<const MaterialId> labels;  // width * height, 255: unknown; empty: overlay off
  float overlay_alpha = 0.5F;          // 0: overlay off, 1: labels only
  bool is_tracked = true;              // false: T_world_depth means nothing, bodies are not drawn
  T_WorldDepth T_world_depth;          // of the picture's camera
  /// The camera of video, depth and labels was turned against the picture's (a pose newer than the images):
  /// carries a direction in the picture's camera into theirs. Identity: the images are shown as they are.
  Rotation R_video_picture;
  Light light;  // one whose direction is zero or not finite counts as the default one
  bool has_shadows = true;
  std::span<const Body> bodies;
  std::span<const Decal> decals;   // the first kDecalsMax are drawn; they need depth
  std::span<const TextLine> text;  // over everything, with or without a pose
  std::optional<Crosshair> crosshair;
};

/// A stage. All calls need a GLES 3 context current on the calling thread, always the same context.
class Renderer {
 public:
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  ~Renderer();

  static std::size_t bytes_needed(const RenderConfig& config);

  /// Compiles the programs and reserves textures and buffers. Boot, once. Errors: bad_usage (distorted
  /// camera, sizes out of range), device_unavailable (no context, a program that this driver does not
  /// compile).
  rt::Result<void> bind(const RenderConfig& config, rt::Slice slice);

  /// Draws every kind of thing once into the bound framebuffer, so that the driver compiles what it compiles
  /// late.
  rt::Result<void> warm_up();

  /// Draws one picture into the bound framebuffer. Step; bounded by the pixels and bodies_count_max; no heap
  /// of ours. ok | full | lost (is_tracked, but the pose is not finite: drawn as if not tracked) |
  /// device_lost.
  rt::Status step(const RenderInputs& inputs) noexcept;

  /// Waits for the picture and copies it: width * height * 3 bytes, row-major from the top. Step. ok |
  /// device_lost.
  rt::Status read_back(std::span<std::uint8_t> rgb) noexcept;

 private:
  enum Texture : std::uint8_t {
    kVideoTexture,
    kDepthTexture,
    kLabelsTexture,
    kPaletteTexture,
    kShadowTexture,
    kFontTexture,
    kTextureCount
  };
  enum Program : std::uint8_t {
    kVideoProgram,
    kOverlayProgram,
    kSphereProgram,
    kMeshProgram,
    kShadeProgram,
    kCraterProgram,
    kCracksProgram,
    kTearProgram,
    kSplinterProgram,
    kDentProgram,
    kCastSphereProgram,
    kCastMeshProgram,
    kTextProgram,
    kProgramCount
  };
  enum Buffer : std::uint8_t {
    kFrameBuffer,
    kSphereBuffer,
    kMeshBuffer,
    kCasterBuffer,
    kDecalBuffer,
    kGlyphBuffer,
    kVertexBuffer,
    kIndexBuffer,
    kBufferCount
  };
  enum VertexArray : std::uint8_t {
    kNoVertices,
    kSphereVertices,
    kMeshVertices,
    kPrismVertices,
    kDecalVertices,
    kGlyphVertices,
    kVertexArrayCount
  };

  [[nodiscard]] std::size_t pixels_count() const;
  rt::Result<void> link_programs();
  rt::Result<void> reserve_textures();
  void reserve_buffers(const MeshSet& meshes);
  void upload_images(const RenderInputs& inputs, bool has_overlay, bool has_depth) noexcept;
  void upload_frame_block(const RenderInputs& inputs, const Light& light, const ShadowView& shadow,
                          bool has_overlay) noexcept;
  void upload_instances(const InstanceCounts& counts, const DecalCounts& decal_counts) noexcept;
  void use(Program program, VertexArray vertices, bool has_warp = false) noexcept;
  void draw_meshes(const InstanceCounts& counts, bool in_view_only) noexcept;
  void draw_decals(const DecalCounts& counts, bool has_warp) noexcept;
  void draw_shadow_map(const InstanceCounts& counts) noexcept;
  void draw_shadows(const InstanceCounts& counts, bool has_warp) noexcept;
  void draw_bodies(const InstanceCounts& counts, bool has_depth, bool has_warp) noexcept;
  void draw_text(std::size_t count) noexcept;

  RenderConfig config_;
  Projection projection_{};
  std::span<SphereInstance> spheres_;
  std::span<MeshInstance> meshes_;
  std::span<Caster> casters_;
  std::span<DecalInstance> decals_;
  std::span<GlyphInstance> glyphs_;
  std::span<float> hull_radii_m_;
  std::span<std::uint8_t> rgba_rows_;  // kRowsPerRead rows on their way from GL to the caller
  std::array<MeshSet::Range, kMeshesMax> mesh_ranges_{};
  std::uint32_t textures_[kTextureCount] = {};  // GL names; 0: none
  std::uint32_t programs_[kProgramCount][2] = {};  // without and with warp; of one text, where it has none
  std::uint32_t buffers_[kBufferCount] = {};
  std::uint32_t vertex_arrays_[kVertexArrayCount] = {};
  std::uint32_t shadow_framebuffer_ = 0;
};

}  // namespace tactus::render
