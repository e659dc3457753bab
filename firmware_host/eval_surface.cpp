#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "firmware_host/commands.hpp"
#include "firmware_host/eval_label_metrics.hpp"
#include "firmware_host/eval_text.hpp"
#include "firmware_host/summary.hpp"
#include "hal/synthetic/synthetic.hpp"
#include "pipeline/evaluate/mesh.hpp"
#include "pipeline/evaluate/surface.hpp"
#include "pipeline/evaluate/trajectory.hpp"

namespace tactus::firmware {
namespace {

/// A label counts where the mesh lies within this of the true surface: farther off, the nearest true surface
/// need not be the one that was meant. Two voxels.
constexpr double kLabelDistanceMax_m = 0.02;

/// The true surface: one of two kinds.
struct Truth {
  std::optional<hal::synthetic::Scene> scene;
  std::optional<evaluate::Mesh> mesh;
  std::optional<evaluate::MeshDistance> mesh_distance;
  std::vector<evaluate::StampedPose> poses;  // empty: unknown
};

rt::Result<Truth> read_synthetic_truth(const EvalSurfaceOptions& options) {
  auto room = hal::parse_synthetic_name(options.truth);
  if (!room) return room.error();
  auto sensor = hal::open_synthetic(*room);
  if (!sensor) return sensor.error();
  Truth truth;
  truth.scene = hal::synthetic::make_scene(room->scene);
  for (const hal::TruthPose& pose : sensor->truth) truth.poses.push_back({pose.time, pose.T_world_depth});
  return truth;
}

rt::Result<Truth> read_mesh_truth(const EvalSurfaceOptions& options) {
  std::filesystem::path file = options.truth;
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) file /= "mesh.ply";
  auto mesh = evaluate::read_ply(file);
  if (!mesh) return mesh.error();
  Truth truth;
  truth.mesh = std::move(*mesh);
  truth.mesh_distance.emplace(*truth.mesh);
  const auto poses_file = file.parent_path() / "groundtruth.txt";
  if (options.truth_poses.empty() && options.align != "none" && std::filesystem::exists(poses_file, error)) {
    auto poses = evaluate::read_trajectory(poses_file);
    if (!poses) return poses.error();
    truth.poses = std::move(poses->poses);
  }
  return truth;
}

struct AlignedBy {
  evaluate::Alignment T_truth_estimate;
  std::string how;  // for people
};

/// The mesh lies in the estimate's world, whose origin and heading are those of its first frame: the camera
/// paths say how the two worlds lie to each other.
rt::Result<AlignedBy> align(const EvalSurfaceOptions& options, const Truth& truth) {
  if (options.align == "none") return AlignedBy{{}, "not aligned: both are taken to be in one world"};
  std::filesystem::path poses_file = options.poses;
  std::error_code error;
  if (poses_file.empty()) {
    const auto beside = options.mesh.parent_path() / "trajectory.txt";
    if (std::filesystem::exists(beside, error)) poses_file = beside;
  }
  if (poses_file.empty() || truth.poses.empty()) {
    if (options.align == "auto") return AlignedBy{{}, "not aligned: no pair of trajectories was found"};
    return rt::Error{
        rt::ExitCode::bad_usage,
        "--align " + options.align +
            (poses_file.empty()
                 ? ": there is no trajectory.txt beside the mesh; name the estimate with --poses."
                 : ": there is no groundtruth.txt beside the true mesh; name it with --truth-poses.")};
  }
  auto estimate = evaluate::read_trajectory(poses_file);
  if (!estimate) return estimate.error();
  auto report = evaluate::evaluate_trajectory(estimate->poses, truth.poses);
  if (!report) return rt::Error{report.error().code, poses_file.string() + ": " + report.error().message};
  if (options.align == "first") {
    return AlignedBy{report->T_truth_estimate_first, "aligned at the first pose of " + poses_file.string()};
  }
  return AlignedBy{report->T_truth_estimate_rigid, "aligned by " + poses_file.string() + " (rigid)"};
}

std::string labels_text(const evaluate::LabelMetrics& m) {
  char line[240];
  std::snprintf(
      line, sizeof(line),
      "labels: pixel accuracy %.3f, mean accuracy %.3f, mean IU %.3f, f.w. IU %.3f; %.1f %% of the surface "
      "is labelled\n",
      m.pixel_accuracy, m.mean_accuracy, m.mean_iu, m.frequency_weighted_iu, m.predicted_share * 100);
  std::string text = line;
  text += "        means are over the " + std::to_string(m.classes_count) +
          " materials that occur in the truth; left out:";
  for (std::size_t i = 0; i < kMaterialCount; ++i)
    if (m.truth_count[i] == 0) text += " " + std::string(kMaterialNames[i]);
  return text + "\n";
}

}  // namespace

rt::Result<std::string> eval_surface(const EvalSurfaceOptions& options) {
  if (options.samples_count == 0 || options.samples_count > 100'000'000) {
    return rt::Error{rt::ExitCode::bad_usage, "--samples: between 1 and 100000000 samples are needed."};
  }
  auto mesh = evaluate::read_ply(options.mesh);
  if (!mesh) return mesh.error();
  auto truth =
      options.truth.starts_with("synthetic:") ? read_synthetic_truth(options) : read_mesh_truth(options);
  if (!truth) return truth.error();
  if (!options.truth_poses.empty()) {
    auto poses = evaluate::read_trajectory(options.truth_poses);
    if (!poses) return poses.error();
    truth->poses = std::move(poses->poses);
  }
  auto aligned = align(options, *truth);
  if (!aligned) return aligned.error();

  const evaluate::Alignment& T = aligned->T_truth_estimate;
  const auto samples = evaluate::sample_surface(*mesh, options.samples_count);
  evaluate::SurfaceReport report;
  evaluate::ConfusionMatrix confusion;
  if (truth->scene) {
    const hal::synthetic::Scene& scene = *truth->scene;
    report = evaluate::evaluate_surface(samples, T, [&](const Vec3d& p) { return scene.distance(p); });
    for (const evaluate::SurfaceSample& sample : samples) {
      const Vec3d p = T * sample.position_m.cast<double>();
      const double d = scene.distance(p);
      if (d < kLabelDistanceMax_m && d > -kLabelDistanceMax_m)
        confusion.add(static_cast<MaterialId>(scene.material(p)), sample.label);
    }
  } else {
    const evaluate::MeshDistance& distance = *truth->mesh_distance;
    report = evaluate::evaluate_surface(samples, T,
                                        [&](const Vec3d& p) { return distance.nearest(p).distance_m; });
    if (!truth->mesh->triangle_labels.empty() || !truth->mesh->vertex_labels.empty())
      confusion = evaluate::compare_labels(samples, T, *truth->mesh, distance, kLabelDistanceMax_m);
  }
  const evaluate::LabelMetrics labels = evaluate::label_metrics(confusion);
  const bool has_labels = labels.predicted_share > 0;

  if (options.is_json) {
    nlohmann::json j = {{"mesh", options.mesh.string()},
                        {"truth", options.truth},
                        {"alignment", aligned->how},
                        {"vertices", mesh->vertices_m.size()},
                        {"triangles", mesh->triangles.size()},
                        {"distance_mm", statistics_json(report.distance_m, 1e3)},
                        {"share_within_5mm", report.share_within_5mm},
                        {"share_within_10mm", report.share_within_10mm},
                        {"share_within_20mm", report.share_within_20mm}};
    if (has_labels) j["labels"] = metrics_json(labels);
    return to_text(j);
  }
  char line[200];
  std::string text = kStatisticsHeading;
  text += statistics_line("distance to the true surface, mm", report.distance_m, 1e3);
  std::snprintf(line, sizeof(line), "%.1f %% within 5 mm, %.1f %% within 10 mm, %.1f %% within 20 mm\n",
                report.share_within_5mm * 100, report.share_within_10mm * 100,
                report.share_within_20mm * 100);
  text += line;
  if (has_labels) text += labels_text(labels);
  text += std::to_string(mesh->vertices_m.size()) + " vertices, " + std::to_string(mesh->triangles.size()) +
          " triangles; " + aligned->how + "\n";
  return text;
}

}  // namespace tactus::firmware
