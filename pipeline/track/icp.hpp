// Frame-to-model tracking: point-to-plane ICP of a depth image against the predicted model view (Chen &
// Medioni 1992; KinectFusion sec. 3.5), association by projecting *model* points into the live image.
//
// That way round each association needs one gather (the live depth) and no live normals: the plane is the
// model's, which is a mean of many frames. The residual of model point p with normal n and live point q at
// the pixel p projects to is r = n . (T q - p); a left increment (w, v) of T = T_view_live changes it by (q'
// x n) . w + n . v, q' = T q, taken about a pivot in the middle of the view so that turning and shifting
// decouple.
//
// Where colour is known, brightness joins in: the view's pixels against the live image at the place they
// project to (Steinbruecker et al. 2011). With g the brightness gradient as a vector in space (image gradient
// times the projection's Jacobian) its residual changes by -((q' x g) . w + g . v): the same sums with -g for
// n. It holds what geometry leaves open, a flat wall above all.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hal/transform.hpp"
#include "pipeline/map/predict.hpp"
#include "pipeline/track/brightness.hpp"

namespace tactus::track {

struct View {};  // the frame of reference of a ModelView
struct Live {};  // the depth camera now
using T_ViewLive = Transform<View, Live>;

/// One level of the coarse-to-fine schedule.
struct IcpLevel {
  int stride;  // of the model view's pixels
  int iterations_max;
  float distance_m_max;  // association gate
};
inline constexpr std::array<IcpLevel, 3> kTrackLevels = {{{4, 10, 0.10f}, {2, 6, 0.06f}, {1, 2, 0.04f}}};
/// From a stored pose, decimetres and tens of degrees off, on a view marched at every fourth, then second
/// pixel.
inline constexpr std::array<IcpLevel, 2> kRelocalizeCoarse = {{{4, 15, 0.40f}, {4, 10, 0.15f}}};
inline constexpr std::array<IcpLevel, 2> kRelocalizeFine = {{{2, 8, 0.08f}, {2, 5, 0.05f}}};

/// Normal equations of one pass; weights are 1 where the residual is within the noise, and fall off beyond
/// (Huber).
struct IcpSums {
  std::array<double, 21> h{};  // upper triangle of H, rows (w_x w_y w_z v_x v_y v_z)
  std::array<double, 6> b{};   // H x = -b
  double weighted_residual2 = 0;
  double weight = 0;
  double inliers_count = 0;     // associations within the gate, on any surface
  double candidates_count = 0;  // model points that project onto a live measurement
  double model_count = 0;       // model points that project into the live image
};

/// What a pass is made with. `live_m`: depth image of the same camera as the model view (half resolution), 0
/// invalid.
struct IcpInput {
  const map::ModelView* model = nullptr;
  std::span<const float> live_m;
  float pivot_z_m = 2.0f;
  // pipeline/track/brightness.hpp; empty: geometry only.
  std::span<const BrightnessWord> model_brightness{};
  std::span<const Luma> live_luma{};
};

/// Rows of one chunk of the strided grid: the unit of the fixed reduction tree, whatever the number of
/// threads.
inline constexpr int kIcpRowsPerChunk = 8;
int icp_chunks_count(const map::ModelView& model, int stride);

/// Sums of one chunk. Any thread. Same bits on every instruction set: sixteen virtual lanes, folded in a
/// fixed order.
IcpSums icp_accumulate(const IcpInput& input, const T_ViewLive& T_view_live, const IcpLevel& level,
                       int chunk) noexcept;

/// The same in double, one pixel at a time: the oracle (equal up to float rounding).
IcpSums icp_accumulate_reference(const IcpInput& input, const T_ViewLive& T_view_live, const IcpLevel& level,
                                 int chunk) noexcept;

/// Adds `part` to `sum`; chunks are added in their order.
void icp_add(IcpSums& sum, const IcpSums& part) noexcept;

/// The increment (w, v) that minimises the quadratic model. Directions whose information per unit weight is
/// below `information_min` (a flat wall: two shifts and a turn) are held: no motion along them; `held_count`
/// says how many.
struct IcpStep {
  std::array<double, 6> increment{};
  std::array<double, 6> information{};  // eigenvalues of H / weight, rotation scaled by lever_m, falling
  int held_count = 0;
};
IcpStep icp_solve(const IcpSums& sums, double lever_m, double information_min) noexcept;

/// T after the increment about the pivot, by the Cayley map (rational: the same bits everywhere).
T_ViewLive icp_apply(const T_ViewLive& T_view_live, const std::array<double, 6>& increment,
                     double pivot_z_m) noexcept;

}  // namespace tactus::track
