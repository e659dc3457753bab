#include "firmware_host/boot.hpp"

#include <utility>

#include "pipeline/contact/materials.hpp"

namespace tactus::firmware {

rt::Result<OpenedSource> open_for_pipeline(const SourceRequest& request, const RunSettings& settings,
                                           const std::function<rt::Result<void>(hal::Sensor&)>& wrap) {
  SourceOptions options = request.options;
  options.live = {settings.profile.sensor_mode, settings.profile.needs_registered};
  auto sensor = open_source(request.source, options);
  if (!sensor) return sensor.error();
  if (auto supported = check_depth_size(request.source, *sensor); !supported) return supported.error();
  if (wrap)
    if (auto wrapped = wrap(*sensor); !wrapped) return wrapped.error();
  auto gravity = find_gravity(request.gravity, *sensor);
  if (!gravity) return gravity.error();
  auto labels = choose_labels(request.source, request.model, settings, *sensor);
  if (!labels) return labels.error();
  return OpenedSource{std::move(*sensor), std::move(*gravity), std::move(*labels)};
}

PipelineSetup setup_for(OpenedSource& source, const RunSettings& settings) {
  PipelineSetup setup;
  setup.profile = settings.profile;
  setup.sensor = &source.sensor;
  setup.T_world_first = level_pose(source.gravity.direction_depth);
  setup.model = source.labels.model ? &source.labels.model->model : nullptr;
  setup.class_map = &source.labels.class_map;
  setup.labels_from_source = source.labels.from_source;
  setup.frames_expected = source.sensor.frames_count;
  setup.light = settings.light;
  setup.materials = contact::default_material_table();
  return setup;
}

rt::Result<BootedPipeline> BootedPipeline::boot(const PipelineSetup& setup) {
  rt::MemoryPlan plan;
  if (auto planned = Pipeline::plan(setup, plan); !planned) return planned.error();
  auto arena = rt::Arena::reserve(plan.arena_bytes());
  if (!arena) return arena.error();
  plan.carve(*arena);
  auto pipeline = std::make_unique<Pipeline>();
  if (auto bound = pipeline->bind(setup, plan); !bound) return bound.error();
  arena->seal();
  return BootedPipeline{std::move(plan), std::move(*arena), std::move(pipeline)};
}

}  // namespace tactus::firmware
