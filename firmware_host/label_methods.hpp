// The methods of the accuracy study (the paper's four and its ablation), each as label images of the same
// frames.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware_host/exact_fusion.hpp"
#include "firmware_host/label_session.hpp"
#include "firmware_host/label_truth.hpp"
#include "pipeline/label/crf/crf.hpp"
#include "pipeline/map/cell_list.hpp"

namespace tactus::firmware {

enum class LabelMethod : std::uint8_t {
  net,         // the network's most likely material of the frame alone (the paper's FCN)
  net_crf2d,   // that, through the dense 2D CRF (CRF-RNN)
  direct,      // the map, where the newest keyframe replaces what was known (ablation)
  fused,       // the map, Bayes' rule (Ours_noCRF)
  fused_crf3d  // that, through the 3D CRF (Ours)
};
inline constexpr std::size_t kLabelMethodsCount = 5;
inline constexpr std::array<std::string_view, kLabelMethodsCount> kLabelMethodNames = {
    "net", "net_crf2d", "direct", "fused", "fused_crf3d"};

/// A frame that is scored.
struct LabelView {
  std::string name;  // of the colour frame
  std::uint64_t depth_sequence = 0;
  bool is_tracked = false;  // else the map says nothing about it
  T_WorldDepth T_world_depth;
  std::vector<std::uint8_t> rgb;
  std::vector<MaterialId> truth;
  std::vector<std::uint32_t> cells;  // per pixel: the place in LabelStudy::cells, or kNoCell
  std::array<std::vector<MaterialId>, kLabelMethodsCount> labels;
};
inline constexpr std::uint32_t kNoCell = 0xFFFFFFFFu;

/// Where the labels of fused_crf3d come from.
enum class CrfSolver : std::uint8_t {
  incremental,  // what the pipeline's own refinement left in the map: the product
  batch         // the solver over all cells of the finished map: the reference
};

/// How fused_crf3d came about, and how near the incremental solver was to the batch solver.
struct CrfOutcome {
  CrfSolver solver = CrfSolver::batch;
  std::string why_batch;            // a sentence when incremental was asked for and could not be had
  std::uint64_t cells_count = 0;    // compared: those with a label; 0 without an incremental result
  std::uint64_t equal_count = 0;    // of them, with the same most probable material
  std::uint64_t regions_count = 0;  // that the incremental solver prepared
};

/// Required of the incremental solver, as a share of cells.
inline constexpr double kCrfAgreementMin = 0.99;

/// A source through every method.
struct LabelStudy {
  hal::Intrinsics camera;  // of every image
  std::vector<LabelView> views;
  std::vector<map::SurfaceCell> cells;                                  // of the finished map
  std::array<std::vector<MaterialId>, kLabelMethodsCount> cell_labels;  // of the map's methods
  std::vector<MaterialId> cell_truth;  // what most of the pixels that hit the cell are; 255 where none does
  std::string network;                 // what labelled
  std::string description;             // of the source
  std::uint64_t frames_count = 0, frames_lost = 0, keyframes_taken = 0, keyframes_fused = 0;
  std::optional<CrfOutcome> crf;  // of fused_crf3d
  // With has_exact_fusion: label words against float64, of the same observations and as they are in the map,
  // which fused while its surface was still moving.
  std::optional<FusionLoss> word_loss, map_loss;
  double label_age_ms_p50 = 0;
  double segment_ms_total = 0, fuse_ms_total = 0;  // of the run with Bayes' rule
  // While it ran, over the visible surface of all tracked frames (label_survey.hpp).
  double live_unlabelled_share = 0, live_label_age_ms = 0;
};

struct LabelStudyRequest {
  LabelSessionOptions session;
  RunSettings settings;
  std::filesystem::path truth;  // folder; empty: the source's own
  std::uint64_t every =
      0;  // of the frames with truth, the first and every so manyth; 0: chosen, see views_every()
  std::uint64_t first_frame = 0;  // depth sequence of the first scored frame
  std::uint64_t views_max = 0;    // 0: no limit
  std::array<bool, kLabelMethodsCount> has_method = {true, true, true, true, true};
  label::CrfParameters crf = label::default_crf_parameters();  // of both solvers
  CrfSolver crf_solver = CrfSolver::incremental;
  // For attributing errors; both need cameras that share pixels.
  bool has_exact_fusion = false;  // float64 and all materials instead of the compact cells; asks for batch
  bool has_true_geometry =
      false;  // pixels ask for the map nearest to their true point instead of casting a ray
};

/// 12, the paper's rhythm of keyframes; 1 where the truth is a handful of images.
[[nodiscard]] std::uint64_t views_every(std::uint64_t asked, std::size_t truth_images_count);

/// Runs the pipeline over the source in lockstep (twice with `direct`: labels never feed the geometry, so
/// both maps have the same cells) and labels each chosen frame by every method. The methods of the map are
/// its dense ray-cast from the frame's tracked pose when the recording is over, as the paper projects its
/// finished model. fused_crf3d is what the running product has found by then; the batch solver over the
/// finished map checks it, and stands in where there is no such result (labels.crf is off, or the lattices of
/// these parameters do not fit the planned region). Errors as LabelSession and LabelTruthImages; bad_input
/// when no frame has truth.
rt::Result<LabelStudy> study_labels(const LabelStudyRequest& request);

}  // namespace tactus::firmware
