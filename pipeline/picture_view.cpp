#include "pipeline/picture_view.hpp"

#include <algorithm>
#include <cmath>

#include "pipeline/register/half_color.hpp"

namespace tactus {
namespace {

bool shares_pixels(const hal::RigCalibration& rig) { return !rig.has_color || rig.registered; }

}  // namespace

void picture_depth(const SensorFrame& frame, std::span<const std::uint16_t> model_half_mm, const hal::RigCalibration& rig,
                   const hal::Intrinsics& picture_camera, std::span<float> depth_m) noexcept {
  const auto unit = static_cast<float>(rig.depth_m_per_unit);
  const auto depth_width = static_cast<std::size_t>(rig.depth.width), depth_height = static_cast<std::size_t>(rig.depth.height);
  const std::size_t half_width = depth_width / 2, half_height = depth_height / 2;
  const auto real_m = [&](std::size_t u, std::size_t v) {
    const std::uint16_t raw = frame.raw_depth[v * depth_width + u];
    if (raw != 0) return static_cast<float>(raw) * unit;
    if (model_half_mm.empty()) return 0.0f;
    return 0.001f * model_half_mm[std::min(v / 2, half_height - 1) * half_width + std::min(u / 2, half_width - 1)];
  };
  if (shares_pixels(rig)) {
    for (std::size_t v = 0, i = 0; v < depth_height; ++v)
      for (std::size_t u = 0; u < depth_width; ++u, ++i) depth_m[i] = real_m(u, v);
    return;
  }
  std::fill(depth_m.begin(), depth_m.end(), 0.0f);
  const T_ColorDepth& T = rig.T_color_depth;
  const int width = picture_camera.width, height = picture_camera.height;
  for (int v = 0; v < rig.depth.height; ++v)
    for (int u = 0; u < rig.depth.width; ++u) {
      const auto z = static_cast<double>(real_m(static_cast<std::size_t>(u), static_cast<std::size_t>(v)));
      if (!(z > 0)) continue;
      const Vec3d p =
          T * Vec3d{(u - rig.depth.cx) / rig.depth.fx * z, (v - rig.depth.cy) / rig.depth.fy * z, z};
      if (!(p.z > 0.05)) continue;
      const double fu = p.x / p.z * picture_camera.fx + picture_camera.cx;
      const double fv = p.y / p.z * picture_camera.fy + picture_camera.cy;
      if (!(fu > -1 && fv > -1 && fu < width && fv < height)) continue;
      // Two by two pixels: colour cameras here are at most a little finer than depth.
      const int u0 = static_cast<int>(std::floor(fu)), v0 = static_cast<int>(std::floor(fv));
      for (int dv = 0; dv < 2; ++dv)
        for (int du = 0; du < 2; ++du) {
          const int x = u0 + du, y = v0 + dv;
          if (x < 0 || y < 0 || x >= width || y >= height) continue;
          float& nearest = depth_m[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                   static_cast<std::size_t>(x)];
          const auto depth = static_cast<float>(p.z);
          if (nearest == 0.0f || depth < nearest) nearest = depth;
        }
    }
}

void keep_model_depth(std::span<const float> model_m, std::span<std::uint16_t> model_mm) noexcept {
  for (std::size_t i = 0; i < model_m.size(); ++i)
    model_mm[i] = model_m[i] > 0 && model_m[i] < 65 ? static_cast<std::uint16_t>(model_m[i] * 1000 + 0.5f) : std::uint16_t{0};
}

T_WorldDepth picture_pose(const T_WorldDepth& T_world_depth, const hal::RigCalibration& rig) noexcept {
  if (shares_pixels(rig)) return T_world_depth;
  const Transform<World, Color> T_world_color = T_world_depth * rig.T_color_depth.inverse();
  return {T_world_color.rotation, T_world_color.translation};  // the renderer's camera is called depth
}

void picture_labels(std::span<const float> depth_m, const hal::Intrinsics& camera,
                    const T_WorldDepth& T_world_camera, const map::Reader& reader,
                    std::span<MaterialId> labels) noexcept {
  constexpr int kStep = 4;
  const auto width = static_cast<std::size_t>(camera.width);
  for (int v = 0; v < camera.height; v += kStep)
    for (int u = 0; u < camera.width; u += kStep) {
      const int cu = std::min(u + kStep / 2, camera.width - 1),
                cv = std::min(v + kStep / 2, camera.height - 1);
      const auto z =
          static_cast<double>(depth_m[static_cast<std::size_t>(cv) * width + static_cast<std::size_t>(cu)]);
      MaterialId label = kUnknownMaterial;
      map::SurfacePoint point;
      if (z > 0) {
        const Vec3d p =
            T_world_camera * Vec3d{(cu - camera.cx) / camera.fx * z, (cv - camera.cy) / camera.fy * z, z};
        if (reader.nearest_surface(p.cast<float>(), point)) label = point.material;
      }
      for (int y = v; y < std::min(v + kStep, camera.height); ++y)
        for (int x = u; x < std::min(u + kStep, camera.width); ++x)
          labels[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] = label;
    }
}

render::Body drawn_body(const contact::BodyState& body, const interact::BodyLook& look,
                        const contact::MaterialTable& materials) noexcept {
  render::Body drawn;
  switch (body.shape.kind) {
    case contact::ShapeKind::sphere: drawn.shape = render::Shape::sphere; break;
    case contact::ShapeKind::box: drawn.shape = render::Shape::box; break;
    case contact::ShapeKind::capsule: drawn.shape = render::Shape::capsule; break;
    case contact::ShapeKind::cylinder: drawn.shape = render::Shape::cylinder; break;
    case contact::ShapeKind::hull: drawn.shape = render::Shape::hull; break;
  }
  drawn.color = look.color;
  const auto radius = static_cast<float>(body.shape.radius_m);
  drawn.half_extent_m = body.shape.kind == contact::ShapeKind::box ? body.shape.half_extents_m.cast<float>()
                                                                   : Vec3f{radius, radius, radius};
  drawn.half_length_m = static_cast<float>(body.shape.half_length_m);
  drawn.hull_index = static_cast<std::uint16_t>(look.hull_index);
  drawn.center_world_m = body.position_world_m;
  drawn.rotation_world_body = body.q_world_body;
  drawn.roughness = static_cast<float>(materials.look_of(body.material).optical_roughness);
  drawn.metalness = static_cast<float>(materials.look_of(body.material).metalness);
  return drawn;
}

render::Decal drawn_decal(const interact::Mark& mark) noexcept {
  render::Decal decal;
  decal.kind = mark.kind;
  decal.position_world_m = mark.position_world_m;
  decal.normal_world = mark.normal_world;
  decal.radius_m = mark.radius_m;
  decal.tint = mark.color;
  decal.seed = mark.seed;
  return decal;
}

HullMeshes::HullMeshes(const interact::ThingCatalogue& catalogue) {
  const auto hulls = catalogue.hulls();
  vertices_m_.reserve(hulls.size() * contact::ConvexHull::kVerticesMax);
  triangles_.reserve(hulls.size() * 2 * contact::ConvexHull::kVerticesMax);
  for (const contact::ConvexHull& hull : hulls) {
    const std::size_t first_vertex = vertices_m_.size(), first_triangle = triangles_.size();
    for (std::size_t i = 0; i < hull.vertices_count; ++i) vertices_m_.push_back(hull.vertex(i).cast<float>());
    std::size_t at = 0;
    for (std::size_t face = 0; face < hull.faces_count; ++face) {
      const std::size_t corners = hull.polygons[at];
      const auto corner = [&](std::size_t i) { return static_cast<std::uint16_t>(hull.polygons[at + 1 + i]); };
      for (std::size_t i = 2; i < corners; ++i) triangles_.push_back({corner(0), corner(i - 1), corner(i)});
      at += corners + 1;
    }
    meshes.push_back({std::span(vertices_m_).subspan(first_vertex), std::span(triangles_).subspan(first_triangle)});
  }
}

std::optional<float> hidden_share(std::span<const contact::BodyState> bodies, const hal::RigCalibration& rig,
                                  const SensorFrame& frame, const T_WorldDepth& T_world_depth) noexcept {
  constexpr int kRaysPerSide = 8;
  constexpr double kBiasM = 0.03;
  const auto T_depth_world = T_world_depth.inverse();
  int in_view = 0, hidden = 0;
  for (const contact::BodyState& body : bodies) {
    const Vec3d p = T_depth_world * body.position_world_m;
    const double radius = contact::reach_m(body.shape);
    if (!(p.z > radius + 0.1)) continue;
    for (int j = 0; j < kRaysPerSide; ++j)
      for (int i = 0; i < kRaysPerSide; ++i) {
        const double dx = (2 * i + 1.0) / kRaysPerSide - 1, dy = (2 * j + 1.0) / kRaysPerSide - 1;
        const double inside = 1 - dx * dx - dy * dy;
        if (inside < 0) continue;
        const double z = p.z - radius * std::sqrt(inside);
        const double u = (p.x + dx * radius) / p.z * rig.depth.fx + rig.depth.cx;
        const double v = (p.y + dy * radius) / p.z * rig.depth.fy + rig.depth.cy;
        if (!(u >= 0 && v >= 0 && u < rig.depth.width && v < rig.depth.height)) continue;
        ++in_view;
        const auto raw =
            frame.raw_depth[static_cast<std::size_t>(v) * static_cast<std::size_t>(rig.depth.width) +
                            static_cast<std::size_t>(u)];
        if (raw > 0 && raw * rig.depth_m_per_unit < z - kBiasM) ++hidden;
      }
  }
  if (in_view == 0) return std::nullopt;
  return static_cast<float>(hidden) / static_cast<float>(in_view);
}

}  // namespace tactus
