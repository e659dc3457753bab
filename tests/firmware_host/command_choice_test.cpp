// Which network labels the room when nobody says, and when somebody does.
#include <gtest/gtest.h>

#include "firmware_host/run_labels.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tactus::firmware {
namespace {

class NoCamera : public hal::ColorCamera {
 public:
  rt::Status read(std::span<std::uint8_t>, hal::FrameHeader&, rt::Duration) override {
    return rt::Status::end_of_stream;
  }
  rt::Status peek(hal::FrameHeader&, rt::Duration) override { return rt::Status::end_of_stream; }
  void skip() override {}
  const hal::CameraCounters& counters() const override { return counters_; }

 private:
  hal::CameraCounters counters_;
};

class NoLabels : public hal::LabelTruth {
 public:
  rt::Status read(std::uint64_t, std::span<std::uint8_t>) override { return rt::Status::end_of_stream; }
};

hal::Sensor sensor_with(bool has_color, bool has_labels) {
  hal::Sensor sensor;
  if (has_color) sensor.color = std::make_unique<NoCamera>();
  if (has_labels) sensor.labels = std::make_unique<NoLabels>();
  return sensor;
}

TEST(ChooseLabels, RecordingWithColourGetsTheNetworkOfTheProgram) {
  const auto choice = choose_labels("some/recording", "", {}, sensor_with(true, false));
  ASSERT_TRUE(choice) << choice.error().message;
  EXPECT_EQ(choice->name, "tactus_materials");
  ASSERT_TRUE(choice->model.has_value());
  EXPECT_EQ(choice->class_map.materials.size(), static_cast<std::size_t>(kMaterialCount));
  EXPECT_FALSE(choice->from_source);
}

TEST(ChooseLabels, RecordingWithItsOwnLabelsStillGetsTheNetwork) {
  // They are truth to score against, not an input: only a synthetic room is labelled by itself.
  const auto choice = choose_labels("some/recording", "", {}, sensor_with(true, true));
  ASSERT_TRUE(choice);
  EXPECT_FALSE(choice->from_source);
  EXPECT_EQ(choice->name, "tactus_materials");
}

TEST(ChooseLabels, SyntheticRoomKeepsItsExactLabels) {
  const auto choice = choose_labels("synthetic:bedroom", "", {}, sensor_with(true, true));
  ASSERT_TRUE(choice);
  EXPECT_TRUE(choice->from_source);
  EXPECT_FALSE(choice->model.has_value());
}

TEST(ChooseLabels, SyntheticRoomWithModelBuiltinGetsTheNetwork) {
  const auto choice = choose_labels("synthetic:bedroom", "builtin", {}, sensor_with(true, true));
  ASSERT_TRUE(choice);
  EXPECT_FALSE(choice->from_source);
  EXPECT_EQ(choice->name, "tactus_materials");
}

TEST(ChooseLabels, ModelNoneLabelsNothing) {
  const auto choice = choose_labels("synthetic:bedroom", "none", {}, sensor_with(true, true));
  ASSERT_TRUE(choice);
  EXPECT_FALSE(choice->from_source);
  EXPECT_FALSE(choice->model.has_value());
  EXPECT_TRUE(choice->name.empty());
  EXPECT_EQ(choice->remark, "Nothing is labelled: --model none.");
}

TEST(ChooseLabels, SourceWithoutColourIsNotLabelledAndSaysSo) {
  const auto choice = choose_labels("some/recording", "", {}, sensor_with(false, false));
  ASSERT_TRUE(choice);
  EXPECT_FALSE(choice->model.has_value());
  EXPECT_EQ(choice->remark, "Nothing is labelled: the source has no colour.");
}

TEST(ChooseLabels, FileThatIsNoNetworkIsBadInput) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("net.tflite", "not a network");
  const auto choice = choose_labels("some/recording", file, {}, sensor_with(true, false));
  ASSERT_FALSE(choice);
  EXPECT_EQ(choice.error().code, rt::ExitCode::bad_input);
}

}  // namespace
}  // namespace tactus::firmware
