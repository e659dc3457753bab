#include "hal/synthetic/pixel_kernels.hpp"

#include <algorithm>

#include "hal/synthetic/depth_noise.hpp"
#include "hal/synthetic/options.hpp"
#include "rt/assert.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hal/synthetic/pixel_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tactus::hal::synthetic {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Rows are padded to whole vectors of up to 64 lanes; every width is a multiple of 16.
using D = hn::CappedTag<float, 16>;
using DU = hn::RebindToUnsigned<D>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VU = hn::Vec<DU>;
using VI = hn::Vec<DI>;
using M = hn::Mask<D>;

/// Trilinear lookup of the room's distance grid; 1 m outside of it.
HWY_INLINE V grid_distance(D d, const Scene::DistanceGrid& grid, V x, V y, V z) {
  const DI di;
  const V per_cell = hn::Set(d, 1.0F / grid.cell_m);
  const V zero = hn::Zero(d);
  const V gx = hn::Mul(hn::Sub(x, hn::Set(d, grid.origin_m.x)), per_cell);
  const V gy = hn::Mul(hn::Sub(y, hn::Set(d, grid.origin_m.y)), per_cell);
  const V gz = hn::Mul(hn::Sub(z, hn::Set(d, grid.origin_m.z)), per_cell);
  const auto within = [&](V v, int size) HWY_ATTR {
    return hn::And(hn::Ge(v, zero), hn::Lt(v, hn::Set(d, static_cast<float>(size - 1))));
  };
  const M inside =
      hn::And(hn::And(within(gx, grid.size[0]), within(gy, grid.size[1])), within(gz, grid.size[2]));
  if (hn::AllFalse(d, inside)) return hn::Set(d, 1.0F);
  const V sx = hn::IfThenElseZero(inside, gx), sy = hn::IfThenElseZero(inside, gy),
          sz = hn::IfThenElseZero(inside, gz);
  const VI ix = hn::ConvertTo(di, sx), iy = hn::ConvertTo(di, sy), iz = hn::ConvertTo(di, sz);
  const V fx = hn::Sub(sx, hn::ConvertTo(d, ix)), fy = hn::Sub(sy, hn::ConvertTo(d, iy)),
          fz = hn::Sub(sz, hn::ConvertTo(d, iz));
  const int row = grid.size[0], slab = row * grid.size[1];
  const VI index = hn::Add(hn::Add(ix, hn::Mul(iy, hn::Set(di, row))), hn::Mul(iz, hn::Set(di, slab)));
  const float* data = grid.distance_m.data();
  const auto along_x = [&](int offset) HWY_ATTR {
    const V a = hn::GatherIndex(d, data + offset, index), b = hn::GatherIndex(d, data + offset + 1, index);
    return hn::Add(a, hn::Mul(hn::Sub(b, a), fx));
  };
  const V a = along_x(0), b = along_x(row), c = along_x(slab), e = along_x(slab + row);
  const V front = hn::Add(a, hn::Mul(hn::Sub(b, a), fy)), back = hn::Add(c, hn::Mul(hn::Sub(e, c), fy));
  return hn::IfThenElse(inside, hn::Add(front, hn::Mul(hn::Sub(back, front), fz)), hn::Set(d, 1.0F));
}

void LightRow(const Scene& scene, const T_WorldDepth& T_world_camera, const PixelRow& rays, std::size_t width,
              const Hits& hits, std::size_t first, float* HWY_RESTRICT light) {
  constexpr float kOpenReach_m = 0.18F;    // a solid this near in front of a surface begins to shade it
  constexpr float kFallOff = 1.0F / 9.0F;  // 1 / (3 m)^2
  constexpr float kAmbient = 0.42F, kFromAbove = 0.10F;
  constexpr float kWrapped = 0.15F;  // a share of the light comes round, so that nothing turns black
  const D d;
  float m[9];
  for (std::size_t i = 0; i < 9; ++i) m[i] = static_cast<float>(T_world_camera.rotation.m[i]);
  const Vec3f origin = T_world_camera.translation.cast<float>();
  const V one = hn::Set(d, 1.0F);
  for (std::size_t i = 0; i < width; i += hn::Lanes(d)) {
    const V x = hn::Load(d, rays.x.data() + i), y = hn::Load(d, rays.y.data() + i);
    const V z = hn::LoadU(d, hits.depth_m.data() + first + i);
    const auto world = [&](std::size_t row, float start) HWY_ATTR {
      const V direction = hn::Add(hn::Add(hn::Mul(hn::Set(d, m[row]), x), hn::Mul(hn::Set(d, m[row + 1]), y)),
                                  hn::Set(d, m[row + 2]));
      return hn::Add(hn::Set(d, start), hn::Mul(direction, z));
    };
    const V px = world(0, origin.x), py = world(3, origin.y), pz = world(6, origin.z);
    const V nx = hn::LoadU(d, hits.normal_x.data() + first + i),
            ny = hn::LoadU(d, hits.normal_y.data() + first + i),
            nz = hn::LoadU(d, hits.normal_z.data() + first + i);
    const V reach = hn::Set(d, kOpenReach_m);
    const V room = grid_distance(d, scene.grid(), hn::Add(px, hn::Mul(nx, reach)),
                                 hn::Add(py, hn::Mul(ny, reach)), hn::Add(pz, hn::Mul(nz, reach)));
    V open = hn::Min(hn::Max(hn::Mul(room, hn::Set(d, 1.0F / kOpenReach_m)), hn::Zero(d)), one);
    open = hn::Add(hn::Set(d, 0.45F), hn::Mul(hn::Set(d, 0.55F), open));
    V sum = hn::Add(hn::Set(d, kAmbient), hn::Mul(hn::Set(d, kFromAbove), ny));
    for (const Light& lamp : scene.lights()) {
      const Vec3f at = lamp.position_world_m.cast<float>();
      const V lx = hn::Sub(hn::Set(d, at.x), px), ly = hn::Sub(hn::Set(d, at.y), py),
              lz = hn::Sub(hn::Set(d, at.z), pz);
      const V d2 = hn::Add(hn::Add(hn::Mul(lx, lx), hn::Mul(ly, ly)), hn::Mul(lz, lz));
      const V facing = hn::Add(hn::Add(hn::Mul(nx, lx), hn::Mul(ny, ly)), hn::Mul(nz, lz));
      const V cosine = hn::Div(hn::Max(facing, hn::Zero(d)), hn::Sqrt(hn::Max(d2, hn::Set(d, 1e-6F))));
      const V soft = hn::Add(hn::Set(d, kWrapped), hn::Mul(hn::Set(d, 1.0F - kWrapped), cosine));
      const V falling = hn::Add(one, hn::Mul(d2, hn::Set(d, kFallOff)));
      sum = hn::Add(sum, hn::Div(hn::Mul(hn::Set(d, lamp.strength), soft), falling));
    }
    hn::Store(hn::Mul(open, sum), d, light + i);
  }
}

/// Integer hash with low bias (C. Wellons, "hash prospector", 2018).
HWY_INLINE VU mix(DU du, VU v) {
  v = hn::Mul(hn::Xor(v, hn::ShiftRight<16>(v)), hn::Set(du, 0x7feb352dU));
  v = hn::Mul(hn::Xor(v, hn::ShiftRight<15>(v)), hn::Set(du, 0x846ca68bU));
  return hn::Xor(v, hn::ShiftRight<16>(v));
}
HWY_INLINE VU draw(DU du, VU pixel_hash, std::uint32_t stream) {
  return mix(du, hn::Xor(pixel_hash, hn::Set(du, stream)));
}
/// [0, 1).
HWY_INLINE V uniform(D d, VU bits) {
  const DI di;
  return hn::Mul(hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<8>(bits))), hn::Set(d, 1.0F / 16777216.0F));
}
HWY_INLINE VU byte_sum(DU du, VU bits) {
  const VU even = hn::Set(du, 0x00ff00ffU);
  const VU pairs = hn::Add(hn::And(bits, even), hn::And(hn::ShiftRight<8>(bits), even));
  return hn::Add(hn::And(pairs, hn::Set(du, 0xffffU)), hn::ShiftRight<16>(pairs));
}
/// Near-normal numbers, zero mean and unit variance: the sum of four bytes (Irwin-Hall; variance 4 (256^2 -
/// 1) / 12, |value| < 3.5) or of eight (|value| < 4.9).
HWY_INLINE V gaussian4(D d, VU bits) {
  const DI di;
  const VI sum = hn::Sub(hn::BitCast(di, byte_sum(DU(), bits)), hn::Set(di, 510));
  return hn::Mul(hn::ConvertTo(d, sum), hn::Set(d, 0.0067658497F));
}
HWY_INLINE V gaussian8(D d, VU low, VU high) {
  const DI di;
  const VU both = hn::Add(byte_sum(DU(), low), byte_sum(DU(), high));
  return hn::Mul(hn::ConvertTo(d, hn::Sub(hn::BitCast(di, both), hn::Set(di, 1020))),
                 hn::Set(d, 0.0047841783F));
}

/// Depth between pixels: bilinear on a continuous surface, the nearest pixel's across an edge.
HWY_INLINE V depth_between(D d, const NoiseRow& row, const float* depth_m, V column, V line, V edge) {
  const DI di;
  const V zero = hn::Zero(d);
  const V u = hn::Min(hn::Max(column, zero), hn::Set(d, static_cast<float>(row.width - 1) - 0.001F));
  const V v = hn::Min(hn::Max(line, zero), hn::Set(d, static_cast<float>(row.height - 1) - 0.001F));
  const VI iu = hn::ConvertTo(di, u), iv = hn::ConvertTo(di, v);
  const V a = hn::Sub(u, hn::ConvertTo(d, iu)), b = hn::Sub(v, hn::ConvertTo(d, iv));
  const VI index = hn::Add(hn::Mul(iv, hn::Set(di, row.width)), iu);
  const V z00 = hn::GatherIndex(d, depth_m, index), z10 = hn::GatherIndex(d, depth_m + 1, index);
  const V z01 = hn::GatherIndex(d, depth_m + row.width, index),
          z11 = hn::GatherIndex(d, depth_m + row.width + 1, index);
  const V low = hn::Min(hn::Min(z00, z10), hn::Min(z01, z11)),
          high = hn::Max(hn::Max(z00, z10), hn::Max(z01, z11));
  const V half = hn::Set(d, 0.5F);
  const M right = hn::Ge(a, half), below = hn::Ge(b, half);
  const V nearest = hn::IfThenElse(below, hn::IfThenElse(right, z11, z01), hn::IfThenElse(right, z10, z00));
  const V top = hn::Add(z00, hn::Mul(hn::Sub(z10, z00), a)),
          bottom = hn::Add(z01, hn::Mul(hn::Sub(z11, z01), a));
  const V smooth = hn::Add(top, hn::Mul(hn::Sub(bottom, top), b));
  return hn::IfThenElse(hn::Gt(hn::Sub(high, low), edge), nearest, smooth);
}

void NoiseRowKernel(const NoiseRow& row, const PixelRow& rays, const Hits& hits,
                    const std::uint32_t* HWY_RESTRICT flags, std::uint16_t* HWY_RESTRICT raw) {
  using namespace noise_model;
  const D d;
  const DU du;
  const DI di;
  const hn::Rebind<std::uint16_t, D> du16;
  const auto width = static_cast<std::size_t>(row.width);
  const auto line = static_cast<std::size_t>(row.row);
  const float* depth_m = hits.depth_m.data();
  const float* here = depth_m + line * width;
  const float* above = row.row > 0 ? here - width : here;
  const float* below = row.row + 1 < row.height ? here + width : here;
  const std::size_t first = line * width;
  // The row with its ends repeated, so that left and right neighbours are plain loads.
  alignas(64) float padded[kRowCapacity + 32];
  padded[15] = here[0];
  std::copy(here, here + width, padded + 16);
  padded[16 + width] = here[width - 1];

  const float* m = row.R_world_depth.data();
  const V one = hn::Set(d, 1.0F);
  const VI lanes = hn::Iota(di, 0);
  for (std::size_t i = 0; i < width; i += hn::Lanes(d)) {
    const V z = hn::Load(d, padded + 16 + i);
    const VU flag = hn::Load(du, flags + i);
    const auto has_flag = [&](std::uint32_t bit) HWY_ATTR {
      return hn::RebindMask(d, hn::Ne(hn::And(flag, hn::Set(du, bit)), hn::Zero(du)));
    };
    M lost = hn::Or(hn::Lt(z, hn::Set(d, static_cast<float>(kZ_m_min))),
                    hn::Gt(z, hn::Set(d, static_cast<float>(kZ_m_max))));
    lost = hn::Or(lost, has_flag(kShadowed));

    const VI column = hn::Add(lanes, hn::Set(di, static_cast<int>(i)));
    const VU pixel = hn::Add(hn::BitCast(du, column), hn::Set(du, static_cast<std::uint32_t>(first)));
    const VU hash = mix(du, pixel);

    const V edge = hn::Mul(z, hn::Set(d, static_cast<float>(kEdgeJump)));
    const auto jumps_to = [&](V neighbor) HWY_ATTR { return hn::Gt(hn::Abs(hn::Sub(neighbor, z)), edge); };
    const M is_edge =
        hn::Or(hn::Or(jumps_to(hn::LoadU(d, padded + 15 + i)), jumps_to(hn::LoadU(d, padded + 17 + i))),
               hn::Or(jumps_to(hn::LoadU(d, above + i)), jumps_to(hn::LoadU(d, below + i))));
    const V edge_draw = uniform(d, draw(du, hash, row.streams.edge));
    lost = hn::Or(lost, hn::And(is_edge, hn::Lt(edge_draw, hn::Set(d, static_cast<float>(kEdgeLoss)))));

    // Patches of 4x4 pixels share their fate.
    const VU patch = hn::Add(hn::ShiftRight<2>(hn::BitCast(du, column)),
                             hn::Set(du, static_cast<std::uint32_t>(row.row / 4) * 4096U));
    const V pane_draw = uniform(d, draw(du, mix(du, patch), row.streams.pane));
    lost = hn::Or(lost,
                  hn::And(has_flag(kPane), hn::Ge(pane_draw, hn::Set(d, static_cast<float>(kPaneReturn)))));

    const V x = hn::Load(d, rays.x.data() + i), y = hn::Load(d, rays.y.data() + i);
    const auto toward = [&](std::size_t k) HWY_ATTR {
      return hn::Add(hn::Add(hn::Mul(hn::Set(d, m[k]), x), hn::Mul(hn::Set(d, m[k + 1]), y)),
                     hn::Set(d, m[k + 2]));
    };
    const V facing = hn::Add(hn::Add(hn::Mul(hn::LoadU(d, hits.normal_x.data() + first + i), toward(0)),
                                     hn::Mul(hn::LoadU(d, hits.normal_y.data() + first + i), toward(3))),
                             hn::Mul(hn::LoadU(d, hits.normal_z.data() + first + i), toward(6)));
    const V length2 = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), one);
    const V limit = hn::Mul(length2, hn::Set(d, static_cast<float>(kGrazing_cosine * kGrazing_cosine)));
    lost = hn::Or(lost, hn::Lt(hn::Mul(facing, facing), limit));

    const V jitter = hn::Set(d, row.jitter_px);
    const V u = hn::Add(hn::ConvertTo(d, column),
                        hn::Mul(jitter, gaussian4(d, draw(du, hash, row.streams.lateral_u))));
    const V v = hn::Add(hn::Set(d, static_cast<float>(row.row)),
                        hn::Mul(jitter, gaussian4(d, draw(du, hash, row.streams.lateral_v))));
    const V beside = depth_between(d, row, depth_m, u, v, edge);
    const V base = hn::IfThenElse(hn::Gt(beside, hn::Zero(d)), beside, z);
    const V over = hn::Sub(base, hn::Set(d, 0.4F));
    const V sigma = hn::Add(hn::Set(d, static_cast<float>(kAxialBase_m)),
                            hn::Mul(hn::Set(d, static_cast<float>(kAxialGrowth_per_m)), hn::Mul(over, over)));
    const V normal =
        gaussian8(d, draw(du, hash, row.streams.axial_low), draw(du, hash, row.streams.axial_high));
    // A neighbour far outside the range may be picked; its noise must not reach zero depth.
    const V noisy = hn::Max(hn::Add(base, hn::Mul(sigma, normal)), hn::Set(d, 0.1F));

    const V steps_at_1m = hn::Set(d, static_cast<float>(kRig_px_m / kDisparityStep_px));
    const V half = hn::Set(d, 0.5F);
    const V steps = hn::ConvertTo(d, hn::ConvertTo(di, hn::Add(hn::Div(steps_at_1m, noisy), half)));
    const V measured = hn::Div(steps_at_1m, hn::Max(steps, one));
    const V units = hn::Add(hn::Mul(measured, hn::Set(d, static_cast<float>(1 / kDepth_m_per_unit))), half);
    lost = hn::Or(lost, hn::Ge(units, hn::Set(d, 65535.0F)));
    const VI value = hn::ConvertTo(di, hn::IfThenZeroElse(lost, units));
    hn::StoreU(hn::DemoteTo(du16, value), du16, raw + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace tactus::hal::synthetic
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tactus::hal::synthetic {

HWY_EXPORT(LightRow);
HWY_EXPORT(NoiseRowKernel);

void light_row(const Scene& scene, const T_WorldDepth& T_world_camera, const PixelRow& rays,
               std::size_t width, const Hits& hits, std::size_t first, std::span<float, kRowCapacity> light) {
  TACTUS_ASSERT(width <= kRowCapacity && width % 16 == 0);
  HWY_DYNAMIC_DISPATCH(LightRow)(scene, T_world_camera, rays, width, hits, first, light.data());
}

void noise_row(const NoiseRow& row, const PixelRow& rays, const Hits& hits,
               std::span<const std::uint32_t, kRowCapacity> flags, std::span<std::uint16_t> raw) {
  TACTUS_ASSERT(row.width <= static_cast<int>(kRowCapacity) && row.width % 16 == 0);
  TACTUS_ASSERT(raw.size() == static_cast<std::size_t>(row.width));
  HWY_DYNAMIC_DISPATCH(NoiseRowKernel)(row, rays, hits, flags.data(), raw.data());
}

}  // namespace tactus::hal::synthetic
#endif
