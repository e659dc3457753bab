// A person's hand on a window: aims, throws and shoots, and switches what is shown.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "hal/input.hpp"
#include "pipeline/pipeline.hpp"

namespace tactus::firmware {

/// Present thread.
class Hand {
 public:
  /// Boot. `input` outlives the hand. The app says what a click does: throws plates, shoots, or (none) throws balls.
  Hand(hal::InputSource& input, interact::App app, int width_px, int height_px);

  /// Takes the events that came and does what they say.
  void obey(Pipeline& pipeline);
  /// How the next picture is to be drawn. Valid until the next call of obey().
  [[nodiscard]] PictureOptions picture(const Pipeline& pipeline);
  [[nodiscard]] bool wants_to_end() const { return wants_to_end_; }

 private:
  void press(hal::Key key, Pipeline& pipeline);
  void type(char character, Pipeline& pipeline);  // letters as capitals
  void use(Pipeline& pipeline);

  hal::InputSource* input_;
  interact::App app_;
  std::array<double, 2> aim_px_, size_px_;
  bool has_overlay_ = false, has_help_ = true, wants_to_end_ = false;
  std::string refusal_;  // shown until the next order
  std::vector<std::string> words_;
  std::vector<render::TextLine> lines_;
};

}  // namespace tactus::firmware
