#include "firmware_host/label_methods.hpp"

#include <algorithm>
#include <utility>

#include "firmware_host/color_names.hpp"
#include "firmware_host/image_refiner.hpp"
#include "firmware_host/label_crf.hpp"
#include "firmware_host/true_depth.hpp"
#include "pipeline/label_survey.hpp"
#include "pipeline/label_view.hpp"
#include "pipeline/source_scores.hpp"

namespace tactus::firmware {
namespace {

/// A ray ends here: farther than any depth that is integrated (profile, depth.max_m), seen from a corner.
constexpr float kRangeM = 10;

constexpr std::size_t at(LabelMethod method) { return static_cast<std::size_t>(method); }

std::size_t pixels_count(const hal::Intrinsics& camera) {
  return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

/// What labels keyframes, asked about single frames: the session's network, or the source's labels in its
/// place.
class FrameLabeller {
 public:
  static rt::Result<std::unique_ptr<FrameLabeller>> of(LabelSession& session) {
    auto labeller = std::make_unique<FrameLabeller>();
    labeller->session_ = &session;
    int width = Pipeline::kSourceScoresWidth, height = Pipeline::kSourceScoresHeight;
    const LabelChoice& choice = session.labels();
    const hal::Intrinsics& color = session.sensor().calibration.color;
    if (!choice.from_source) {
      const segment::SegmenterConfig config{&choice.model->model, &choice.class_map, color.width,
                                            color.height};
      const auto bytes = segment::Segmenter::bytes_needed(config);
      if (!bytes) return bytes.error();
      auto arena = rt::Arena::reserve(*bytes);
      if (!arena) return arena.error();
      labeller->network_arena_.emplace(std::move(*arena));
      auto bound = segment::Segmenter::bind(config, labeller->network_arena_->carve(*bytes));
      if (!bound) return bound.error();
      labeller->network_.emplace(std::move(*bound));
      width = labeller->network_->scores_width();
      height = labeller->network_->scores_height();
    }
    labeller->memory_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                             kMaterialCount);
    labeller->scores_ = {width, height, labeller->memory_, {}, {}};
    return labeller;
  }

  rt::Result<const segment::MaterialScores*> label(std::uint64_t depth_sequence,
                                                   std::span<const std::uint8_t> rgb) {
    if (network_) {
      if (network_->step(rgb, scores_) != rt::Status::ok)
        return rt::Error{rt::ExitCode::failed,
                         "The network failed on frame " + std::to_string(depth_sequence) + "."};
      return &scores_;
    }
    const hal::Intrinsics& depth = session_->sensor().calibration.depth;
    ids_.resize(pixels_count(depth));
    if (session_->sensor().labels->read(depth_sequence, ids_) != rt::Status::ok)
      std::fill(ids_.begin(), ids_.end(), kUnknownMaterial);
    scores_of_labels(ids_, depth, scores_);
    return &scores_;
  }

 private:
  LabelSession* session_ = nullptr;
  std::optional<rt::Arena> network_arena_;
  std::optional<segment::Segmenter> network_;
  std::vector<std::uint8_t> memory_;
  std::vector<MaterialId> ids_;
  segment::MaterialScores scores_;
};

std::vector<map::SurfaceCell> cells_of(const map::Map& map) {
  std::vector<map::SurfaceCell> cells(map::count_surface_cells(map));
  map::gather_surface_cells(map, cells);
  return cells;
}

/// Of costs relative to the best; unknown where all are equal, since nothing was observed.
std::vector<MaterialId> best_labels(std::span<const float> unary_nat) {
  std::vector<MaterialId> labels(unary_nat.size() / kMaterialCount, kUnknownMaterial);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const float* cost = &unary_nat[i * kMaterialCount];
    if (*std::max_element(cost, cost + kMaterialCount) > 0)
      labels[i] = static_cast<MaterialId>(std::min_element(cost, cost + kMaterialCount) - cost);
  }
  return labels;
}

std::vector<label::LabelWord> words_of(std::span<const map::SurfaceCell> cells) {
  std::vector<label::LabelWord> words;
  words.reserve(cells.size());
  for (const map::SurfaceCell& cell : cells) words.push_back(cell.word);
  return words;
}

/// As map::Reader answers: refined where the CRF has come by, else as fused.
std::vector<MaterialId> refined_labels(std::span<const map::SurfaceCell> cells) {
  std::vector<MaterialId> labels;
  labels.reserve(cells.size());
  for (const map::SurfaceCell& cell : cells)
    labels.push_back(label::seen_material(cell.word, cell.refined));
  return labels;
}

/// Labels of fused_crf3d. `points`: the cells with the costs that the batch solver starts from.
rt::Result<std::vector<MaterialId>> label_by_crf(const LabelStudyRequest& request, const Pipeline& pipeline,
                                                 std::span<const map::SurfaceCell> cells,
                                                 const label::CrfPoints& points, CrfOutcome& outcome) {
  auto batch = refine_cells(points, request.crf);
  if (!batch) return batch.error();
  const bool is_wanted = request.crf_solver == CrfSolver::incremental && !request.has_exact_fusion;
  if (!is_wanted) return std::move(batch->labels);
  const map::LabelRefiner* refiner = pipeline.refiner();
  if (refiner == nullptr) {
    outcome.why_batch = "labels.crf is off.";
    return std::move(batch->labels);
  }
  outcome.regions_count = refiner->counters().regions;
  if (!refiner->is_idle()) {
    outcome.why_batch =
        "these parameters do not fit the region that is planned for the incremental solver: it has not come "
        "to an end.";
    return std::move(batch->labels);
  }
  outcome.solver = CrfSolver::incremental;
  std::vector<MaterialId> labels = refined_labels(cells);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == kUnknownMaterial) continue;
    ++outcome.cells_count;
    outcome.equal_count += labels[i] == batch->labels[i] ? 1u : 0u;
  }
  return labels;
}

std::vector<MaterialId> best_labels(std::span<const map::SurfaceCell> cells) {
  std::vector<MaterialId> labels;
  labels.reserve(cells.size());
  for (const map::SurfaceCell& cell : cells) labels.push_back(label::best(cell.word));
  return labels;
}

/// Which cell of the list each pixel of a view sees.
void find_cells(const map::Reader& reader, const hal::RigCalibration& rig,
                std::span<const float> true_depth_m, LabelStudy& study, LabelView& view) {
  view.cells.assign(pixels_count(study.camera), kNoCell);
  if (!view.is_tracked) return;
  std::vector<map::CellAddress> hits(view.cells.size());
  const PictureCamera camera = picture_camera_at(view.T_world_depth, rig);
  if (true_depth_m.empty())
    cast_cells(reader, camera, kRangeM, hits, {});
  else
    nearest_cells(reader, camera, true_depth_m, hits);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].key == map::kNoKey) continue;
    const auto found = std::lower_bound(
        study.cells.begin(), study.cells.end(), hits[i],
        [](const map::SurfaceCell& cell, const map::CellAddress& address) { return cell.address < address; });
    if (found != study.cells.end() && found->address == hits[i])
      view.cells[i] = static_cast<std::uint32_t>(found - study.cells.begin());
  }
}

void project(std::span<const MaterialId> cell_labels, const LabelView& view,
             std::vector<MaterialId>& labels) {
  labels.resize(view.cells.size());
  for (std::size_t i = 0; i < view.cells.size(); ++i)
    labels[i] = view.cells[i] == kNoCell ? kUnknownMaterial : cell_labels[view.cells[i]];
}

std::vector<MaterialId> majority_truth(const LabelStudy& study) {
  std::vector<std::array<std::uint32_t, kMaterialCount>> votes(study.cells.size());
  for (const LabelView& view : study.views)
    for (std::size_t i = 0; i < view.cells.size(); ++i)
      if (view.cells[i] != kNoCell && view.truth[i] < kMaterialCount) ++votes[view.cells[i]][view.truth[i]];
  std::vector<MaterialId> truth;
  truth.reserve(votes.size());
  for (const auto& counts : votes) {
    const auto most = std::max_element(counts.begin(), counts.end());
    truth.push_back(*most == 0 ? kUnknownMaterial : static_cast<MaterialId>(most - counts.begin()));
  }
  return truth;
}

/// What the map knew of the visible surface, frame after frame.
struct LiveLabels {
  std::uint64_t surface_count = 0, unlabelled_count = 0, age_frames_sum = 0;

  void add(const Spine& spine) {
    LabelSurveyInput input;
    input.map = &spine.map();
    input.model = &spine.model();
    input.color_pixels = spine.color_pixels();
    input.frame_index = spine.frame_index();
    const LabelSurvey survey = survey_labels(input);
    surface_count += survey.surface_count;
    unlabelled_count += survey.unlabelled_count;
    age_frames_sum += survey.label_age_frames_sum;
  }
};

double sum_ms(std::span<const float> series_ms) {
  double sum = 0;
  for (const float ms : series_ms)
    if (ms == ms) sum += static_cast<double>(ms);  // NaN: did not run
  return sum;
}

}  // namespace

std::uint64_t views_every(std::uint64_t asked, std::size_t truth_images_count) {
  constexpr std::size_t kHandful = 24;
  if (asked > 0) return asked;
  return truth_images_count > 0 && truth_images_count <= kHandful ? 1 : 12;
}

rt::Result<LabelStudy> study_labels(const LabelStudyRequest& request) {
  LabelSessionOptions options = request.session;
  options.rule = map::LabelRule::bayes;
  if (request.has_method[at(LabelMethod::fused_crf3d)] && request.crf_solver == CrfSolver::incremental &&
      !request.has_exact_fusion)
    options.crf = request.crf;
  auto opened = LabelSession::open(options, request.settings);
  if (!opened) return opened.error();
  LabelSession& session = **opened;
  hal::Sensor& sensor = session.sensor();
  const hal::RigCalibration& rig = sensor.calibration;
  if (!rig.has_color)
    return rt::Error{rt::ExitCode::bad_usage,
                     options.source + " has no colour, and labels are scored in its pixels."};
  auto truth = request.truth.empty() ? LabelTruthImages::of_sensor(options.source, sensor)
                                     : LabelTruthImages::in_folder(request.truth);
  if (!truth) return truth.error();
  auto names = ColorNames::of(options.source);
  if (!names) return names.error();
  if ((request.has_exact_fusion || request.has_true_geometry) && !rig.registered)
    return rt::Error{rt::ExitCode::bad_usage,
                     options.source + ": errors can be attributed only where depth and colour share pixels."};
  std::optional<TrueDepth> true_depth;
  std::vector<std::vector<float>> true_depths_m;  // per view, when asked for
  if (request.has_true_geometry) {
    auto exact = TrueDepth::of(options.source, rig);
    if (!exact) return exact.error();
    true_depth.emplace(std::move(*exact));
  }
  ExactFusion exact_fusion;
  auto labeller = FrameLabeller::of(session);
  if (!labeller) return labeller.error();

  ImageRefiner image_refiner;
  LiveLabels live;

  LabelStudy study;
  study.camera = picture_camera_at({}, rig).intrinsics;
  study.network = session.labels().name;
  study.description = sensor.description;
  const std::uint64_t every = views_every(request.every, truth->images_count());
  std::uint64_t with_truth_count = 0;
  std::uint64_t keyframes_count = 0;
  auto ran = session.run("label", [&](const ObservedFrame& frame) -> rt::Result<void> {
    if (frame.is_tracked) live.add(session.pipeline().spine());
    if (request.has_exact_fusion && session.pipeline().counts().keyframes > keyframes_count) {
      keyframes_count = session.pipeline().counts().keyframes;
      const auto scores = (*labeller)->label(frame.depth_sequence, frame.rgb);
      if (!scores) return scores.error();
      exact_fusion.add(frame.T_world_depth, session.pipeline().spine().half_depth_m(),
                       session.pipeline().spine().panes().pane_bits(), **scores);
    }
    if (!frame.color_sequence || frame.depth_sequence < request.first_frame) return {};
    const std::string name = names->name(*frame.color_sequence);
    if (!truth->has(name) || with_truth_count++ % every != 0) return {};
    if (request.views_max > 0 && study.views.size() >= request.views_max) return {};
    LabelView view{name, frame.depth_sequence, frame.is_tracked, frame.T_world_depth, {}, {}, {}, {}};
    view.rgb.assign(frame.rgb.begin(), frame.rgb.end());
    view.truth.resize(pixels_count(study.camera));
    if (auto read =
            truth->read(name, frame.depth_sequence, study.camera.width, study.camera.height, view.truth);
        !read)
      return read;
    if (true_depth) {
      std::vector<float> depth_m(view.truth.size());
      const auto known = true_depth->read(frame.depth_sequence, frame.time, depth_m);
      if (!known) return known.error();
      if (!*known)
        return rt::Error{rt::ExitCode::bad_input,
                         options.source + ": the exact depth of scored frame " + name + " is not known."};
      true_depths_m.push_back(std::move(depth_m));
    }
    const auto scores = (*labeller)->label(frame.depth_sequence, frame.rgb);
    if (!scores) return scores.error();
    if (request.has_method[at(LabelMethod::net)]) {
      view.labels[at(LabelMethod::net)].resize(view.truth.size());
      labels_of_scores(**scores, study.camera.width, study.camera.height, view.labels[at(LabelMethod::net)]);
    }
    if (request.has_method[at(LabelMethod::net_crf2d)]) {
      view.labels[at(LabelMethod::net_crf2d)].resize(view.truth.size());
      if (auto refined = image_refiner.refine(**scores, view.rgb, study.camera.width, study.camera.height,
                                              view.labels[at(LabelMethod::net_crf2d)]);
          !refined)
        return refined;
    }
    study.views.push_back(std::move(view));
    return {};
  });
  if (!ran) return ran.error();
  if (study.views.empty())
    return rt::Error{
        rt::ExitCode::bad_input,
        (request.truth.empty() ? options.source : request.truth.string()) +
            ": no colour frame that was played has true labels; label images are PNG files named "
            "as the colour frames."};
  const PipelineCounts& counts = session.pipeline().counts();
  study.frames_count = counts.frames_in;
  study.frames_lost = counts.frames_lost;
  study.keyframes_taken = counts.keyframes;
  study.keyframes_fused = counts.keyframes_segmented;
  if (live.surface_count > 0)
    study.live_unlabelled_share =
        static_cast<double>(live.unlabelled_count) / static_cast<double>(live.surface_count);
  if (const std::uint64_t labelled_count = live.surface_count - live.unlabelled_count; labelled_count > 0)
    study.live_label_age_ms = static_cast<double>(live.age_frames_sum) / static_cast<double>(labelled_count) *
                              1e3 / sensor.frame_rate_hz;
  study.segment_ms_total = sum_ms(session.pipeline().series_ms(Stage::segment));
  study.fuse_ms_total = sum_ms(session.pipeline().series_ms(Stage::fuse));
  if (const auto series = session.pipeline().label_ages_ms(); !series.empty()) {
    std::vector<float> ages(series.begin(), series.end());
    std::nth_element(ages.begin(), ages.begin() + static_cast<std::ptrdiff_t>(ages.size() / 2), ages.end());
    study.label_age_ms_p50 = static_cast<double>(ages[ages.size() / 2]);
  }

  // The finished map, seen from where each frame was taken.
  study.cells = cells_of(session.map());
  for (std::size_t v = 0; v < study.views.size(); ++v)
    find_cells(session.pipeline().reader(), rig,
               true_depths_m.empty() ? std::span<const float>{} : std::span<const float>(true_depths_m[v]),
               study, study.views[v]);
  CellPoints points(study.cells);
  if (request.has_exact_fusion) {
    FusedTwice fused = exact_fusion.fuse(study.cells, rig, session.pipeline().spine().half_camera(),
                                         session.map().config().voxel_size_m);
    study.word_loss = loss_of(fused.words, fused);
    study.map_loss = loss_of(words_of(study.cells), fused);
    points.unary_nat = std::move(fused.unary_nat);
  }
  study.cell_truth = majority_truth(study);
  if (request.has_method[at(LabelMethod::fused)])
    study.cell_labels[at(LabelMethod::fused)] =
        request.has_exact_fusion ? best_labels(points.unary_nat) : best_labels(study.cells);
  if (request.has_method[at(LabelMethod::fused_crf3d)]) {
    auto refined =
        label_by_crf(request, session.pipeline(), study.cells, points.points(), study.crf.emplace());
    if (!refined) return refined.error();
    study.cell_labels[at(LabelMethod::fused_crf3d)] = std::move(*refined);
  }
  if (request.has_method[at(LabelMethod::direct)]) {
    opened->reset();  // one map at a time
    options.rule = map::LabelRule::direct;
    options.crf.reset();
    auto again = LabelSession::open(options, request.settings);
    if (!again) return again.error();
    auto replayed =
        (*again)->run("label, direct mapping", [](const ObservedFrame&) -> rt::Result<void> { return {}; });
    if (!replayed) return replayed.error();
    const std::vector<map::SurfaceCell> cells = cells_of((*again)->map());
    TACTUS_ASSERT(std::equal(cells.begin(), cells.end(), study.cells.begin(), study.cells.end(),
                             [](const auto& a, const auto& b) { return a.address == b.address; }));
    study.cell_labels[at(LabelMethod::direct)] = best_labels(cells);
  }
  for (LabelView& view : study.views)
    for (std::size_t m = 0; m < kLabelMethodsCount; ++m)
      if (!study.cell_labels[m].empty()) project(study.cell_labels[m], view, view.labels[m]);
  return study;
}

}  // namespace tactus::firmware
