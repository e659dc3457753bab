#include "pipeline/label_survey.hpp"

#include <algorithm>
#include <cmath>

#include "pipeline/label/label_cell.hpp"
#include "pipeline/register/depth_images.hpp"
#include "pipeline/register/half_color.hpp"
#include "rt/assert.hpp"

namespace tactus {
namespace {

constexpr float kFacingMin = 0.3f;  // fusing asks for 0.2 of the cell's own normal, which differs a little
constexpr double kNearM = 0.1;
constexpr float kAgreeVoxels = 3.0f,
                kAgreeSigmas = 3.0f;  // generous: the question is which surface, not where
constexpr std::uint32_t kLeftOutFrames = 90;

/// Where a camera of the half image's intrinsics sees a point.
struct Projected {
  double u = 0, v = 0, z = 0;
};

bool project(const Transform<Depth, World>& T_depth_world, const hal::Intrinsics& camera,
             const Vec3d& p_world, Projected& out) noexcept {
  const Vec3d p = T_depth_world * p_world;
  if (!(p.z > kNearM)) return false;
  out = {camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy, p.z};
  return true;
}

/// The way from a pixel to where another camera sees its surface, at most the image's width.
double way_px(const Transform<Depth, World>& T_depth_world, const hal::Intrinsics& camera,
              const Vec3d& p_world, double u, double v) noexcept {
  Projected there;
  if (!project(T_depth_world, camera, p_world, there)) return camera.width;
  const double du = there.u - u, dv = there.v - v;
  return std::min(static_cast<double>(camera.width), std::sqrt(du * du + dv * dv));
}

class UnderWay {
 public:
  explicit UnderWay(const KeyframeUnderWay& keyframe)
      : half_depth_m_(keyframe.half_depth_m), T_depth_world_(keyframe.T_world_depth.inverse()) {}
  UnderWay() = default;

  [[nodiscard]] bool has_seen(const hal::Intrinsics& camera, const Vec3d& p_world,
                              float voxel_size_m) const noexcept {
    Projected at;
    if (!project(T_depth_world_, camera, p_world, at)) return false;
    const double u = at.u + 0.5, v = at.v + 0.5;
    if (!(u >= 0 && v >= 0 && u < camera.width && v < camera.height)) return false;
    const float measured_m =
        half_depth_m_[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
                      static_cast<std::size_t>(u)];
    const float tolerance_m = std::max(kAgreeVoxels * voxel_size_m, kAgreeSigmas * depth_sigma_m(measured_m));
    return measured_m > 0 && std::fabs(measured_m - static_cast<float>(at.z)) <= tolerance_m;
  }

 private:
  std::span<const float> half_depth_m_;
  Transform<Depth, World> T_depth_world_;
};

constexpr std::size_t kUnderWayMax = 4;

}  // namespace

LabelSurvey survey_labels(const LabelSurveyInput& input) noexcept {
  TACTUS_ASSERT(input.under_way.size() <= kUnderWayMax);
  const map::Map& map = *input.map;
  const map::ModelView& model = *input.model;
  const hal::Intrinsics& camera = model.camera;
  const float voxel_size_m = map.config().voxel_size_m;
  const double to_voxels = 1.0 / static_cast<double>(voxel_size_m);
  std::array<UnderWay, kUnderWayMax> under_way;
  for (std::size_t i = 0; i < input.under_way.size(); ++i) under_way[i] = UnderWay(input.under_way[i]);
  Transform<Depth, World> T_before_world, T_keyframe_world;
  if (input.T_world_before) T_before_world = input.T_world_before->inverse();
  if (input.T_world_keyframe) T_keyframe_world = input.T_world_keyframe->inverse();

  LabelSurvey survey;
  double moved_px = 0, moved_since_keyframe_px = 0;
  for (int row = 0; row < kSurveyRows; ++row)
    for (int column = 0; column < kSurveyColumns; ++column) {
      const int u = (2 * column + 1) * camera.width / (2 * kSurveyColumns),
                v = (2 * row + 1) * camera.height / (2 * kSurveyRows);
      const std::size_t pixel =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(u);
      const float z_m = model.z_m[pixel];
      if (!(z_m > 0)) continue;
      if (!input.color_pixels.empty() && input.color_pixels[pixel] == kNoColorPixel) continue;
      const Vec3d ray{(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1};
      const Vec3d normal = Vec3f{model.nx[pixel], model.ny[pixel], model.nz[pixel]}.cast<double>();
      if (!(-normal.dot(ray) >= static_cast<double>(kFacingMin) * ray.norm())) continue;
      const Vec3d p_world = model.T_world_view * (ray * static_cast<double>(z_m));
      const auto voxel = [&](double coordinate_m) {
        return static_cast<std::int32_t>(std::floor(coordinate_m * to_voxels + 0.5));
      };
      const std::int32_t x = voxel(p_world.x), y = voxel(p_world.y), z = voxel(p_world.z);
      const map::BlockIndex block =
          map.find(map::key_of({map::block_of(x), map::block_of(y), map::block_of(z)}));
      if (block == map::kNoBlock) continue;

      ++survey.surface_count;
      if (input.T_world_before) moved_px += way_px(T_before_world, camera, p_world, u, v);
      if (input.T_world_keyframe) moved_since_keyframe_px += way_px(T_keyframe_world, camera, p_world, u, v);
      std::uint32_t seen_count = 0;
      for (std::size_t i = 0; i < input.under_way.size(); ++i)
        seen_count += under_way[i].has_seen(camera, p_world, voxel_size_m) ? 1u : 0u;

      const map::LabelWord word = map.labels(block)[static_cast<std::size_t>(
          map::cell_of_voxel(map::in_block(x), map::in_block(y), map::in_block(z)))];
      const std::uint32_t labelled_frame = map.label_frame_concurrent(block);
      const std::uint32_t age_frames = input.frame_index - labelled_frame;
      if (word == 0) {
        ++survey.unlabelled_count;
        const bool was_left_out = labelled_frame > 0 && age_frames < kLeftOutFrames;
        if (seen_count == 0 && !was_left_out) ++survey.new_count;
        if (seen_count > 0 && seen_count < input.weak_observations) ++survey.weak_count;
        continue;
      }
      survey.label_age_frames_sum += age_frames;
      if (label::observations(word) + seen_count < input.weak_observations) ++survey.weak_count;
      if (seen_count == 0 && age_frames >= input.old_frames) ++survey.old_count;
    }
  if (survey.surface_count > 0) {
    const auto count = static_cast<double>(survey.surface_count);
    if (input.T_world_before) survey.moved_half_px = static_cast<float>(moved_px / count);
    if (input.T_world_keyframe)
      survey.moved_since_keyframe_half_px = static_cast<float>(moved_since_keyframe_px / count);
  }
  return survey;
}

}  // namespace tactus
