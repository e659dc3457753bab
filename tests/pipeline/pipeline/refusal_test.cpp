// A keyframe that the network fails on costs that keyframe and nothing else.
#include <gtest/gtest.h>
#include <xnnpack.h>

#include <string>

#include "pipeline/segment/builtin_class_maps.hpp"
#include "pipeline/segment/builtin_network.hpp"
#include "pipeline/segment/tflite_model.hpp"
#include "tests/pipeline/pipeline/scripted_session.hpp"

namespace {
bool refuses = false;
}

// The linker sends the program's calls of xnn_run_operator() here.
extern "C" {
// NOLINTBEGIN(bugprone-reserved-identifier): the linker's names
xnn_status __real_xnn_run_operator(xnn_operator_t op, pthreadpool_t threadpool);
xnn_status __wrap_xnn_run_operator(xnn_operator_t op, pthreadpool_t threadpool) {
  return refuses ? xnn_status_out_of_memory : __real_xnn_run_operator(op, threadpool);
}
// NOLINTEND(bugprone-reserved-identifier): the linker's names
}

namespace tactus {
namespace {

TEST(PipelineRefusal, AnsweredKeyframesBehindARefusedOneAreFused) {
  auto model = segment::read_tflite(segment::builtin_network(), std::string(segment::kBuiltinNetworkName));
  ASSERT_TRUE(model) << model.error().message;
  std::optional<segment::ClassMap> class_map;
  for (const auto& builtin : segment::kBuiltinClassMaps)
    if (segment::kBuiltinNetworkName.find(builtin.model_name_part) != std::string_view::npos) {
      auto parsed = segment::parse_class_map(builtin.toml, builtin.file);
      ASSERT_TRUE(parsed);
      class_map = std::move(*parsed);
    }
  ASSERT_TRUE(class_map.has_value());
  PipelineSetup setup;
  setup.model = &*model;
  setup.class_map = &*class_map;
  setup.profile.keyframes.every_frames = 1;
  test::ScriptedSession session({0, 1, 2}, setup);
  Pipeline& sut = *session.pipeline;
  // The first one's cells take several frames to fuse; meanwhile the second is refused and the third
  // answered.
  ASSERT_TRUE(session.step());
  refuses = true;
  ASSERT_TRUE(session.step());
  refuses = false;
  ASSERT_TRUE(session.step());
  ASSERT_EQ(sut.counts().keyframes, 3u);
  ASSERT_EQ(sut.counts().keyframes_segmented, 0u) << "the first one is under way";
  sut.finish_labels();
  EXPECT_EQ(sut.counts().keyframes_segmented, 2u);
}

}  // namespace
}  // namespace tactus
