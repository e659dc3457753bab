#include "firmware_host/hand.hpp"

#include <algorithm>

namespace tactus::firmware {
namespace {

constexpr double kAimStepPx = 12;
constexpr float kOverlay = 0.55f;
constexpr int kLinePx = 12, kMarginPx = 8;
constexpr Rgb8 kTextColor{255, 255, 255};

constexpr std::array<const char*, 6> kHelp = {"mouse or arrows  aim", "click or space   throw / shoot",
                                              "1 2 3            none / uniform / semantic", "L                labels",
                                              "P S B            plates / shooting / balls", "H help           Esc end"};

std::string_view app_name(interact::App app) {
  return app == interact::App::plates ? "plates" : app == interact::App::shooting ? "shooting" : "balls";
}

}  // namespace

Hand::Hand(hal::InputSource& input, interact::App app, int width_px, int height_px)
    : input_(&input),
      app_(app),
      aim_px_{0.5 * width_px, 0.5 * height_px},
      size_px_{static_cast<double>(width_px), static_cast<double>(height_px)} {}

void Hand::obey(Pipeline& pipeline) {
  hal::InputEvent event;
  while (input_->poll(event)) {
    switch (event.kind) {
      case hal::InputEvent::Kind::key_down: press(event.key, pipeline); break;
      case hal::InputEvent::Kind::pointer_move:
        aim_px_ = {static_cast<double>(event.x_px), static_cast<double>(event.y_px)};
        break;
      case hal::InputEvent::Kind::button_down:
        if (event.button != 1) break;
        aim_px_ = {static_cast<double>(event.x_px), static_cast<double>(event.y_px)};
        use(pipeline);
        break;
      case hal::InputEvent::Kind::close: wants_to_end_ = true; break;
      case hal::InputEvent::Kind::key_up:
      case hal::InputEvent::Kind::button_up:
      case hal::InputEvent::Kind::resize: break;
    }
  }
  for (std::size_t i = 0; i < 2; ++i) aim_px_[i] = std::clamp(aim_px_[i], 0.0, size_px_[i] - 1);
}

void Hand::press(hal::Key key, Pipeline& pipeline) {
  switch (key) {
    case hal::Key::left: aim_px_[0] -= kAimStepPx; break;
    case hal::Key::right: aim_px_[0] += kAimStepPx; break;
    case hal::Key::up: aim_px_[1] -= kAimStepPx; break;
    case hal::Key::down: aim_px_[1] += kAimStepPx; break;
    case hal::Key::space: use(pipeline); break;
    case hal::Key::escape: wants_to_end_ = true; break;
    default: type(static_cast<char>(key), pipeline); break;
  }
}

void Hand::type(char character, Pipeline& pipeline) {
  switch (character) {
    case '1': pipeline.set_collision(contact::Collision::none); break;
    case '2': pipeline.set_collision(contact::Collision::uniform); break;
    case '3': pipeline.set_collision(contact::Collision::semantic); break;
    case 'L': has_overlay_ = !has_overlay_; break;
    case 'H': has_help_ = !has_help_; break;
    case 'P': app_ = interact::App::plates; break;
    case 'S': app_ = interact::App::shooting; break;
    case 'B': app_ = interact::App::none; break;
    default: break;
  }
}

void Hand::use(Pipeline& pipeline) {
  rt::Status status = rt::Status::ok;
  if (app_ == interact::App::shooting) {
    interact::Shot shot;
    shot.aim.pixel = aim_px_;
    status = pipeline.shoot_now(shot);
  } else {
    interact::Throw what;
    what.aim.pixel = aim_px_;
    what.in_front_m = 0.3;
    what.speed_m_per_s = 5;
    if (app_ == interact::App::plates)
      what.thing = interact::ThingKind::plate;
    else
      what.shape = contact::Shape::sphere(0.06);
    status = pipeline.throw_now(what);
  }
  refusal_ = status == rt::Status::ok     ? ""
             : status == rt::Status::lost ? "no pose: look at what the map knows"
                                          : "no room for more things";
}

PictureOptions Hand::picture(const Pipeline& pipeline) {
  words_.clear();
  words_.push_back(std::string(app_name(app_)) + ", " +
                   std::string(contact::kCollisionNames[static_cast<std::size_t>(pipeline.collision())]) +
                   (has_help_ ? "" : "   H: help"));
  if (!refusal_.empty()) words_.push_back(refusal_);
  if (has_help_) words_.insert(words_.end(), kHelp.begin(), kHelp.end());
  lines_.clear();
  int y = kMarginPx;
  for (const std::string& line : words_) {
    lines_.push_back({line, kMarginPx, y, kTextColor, 1});
    y += kLinePx;
  }
  PictureOptions options;
  options.overlay_alpha = has_overlay_ ? kOverlay : 0;
  options.text = lines_;
  options.crosshair =
      render::Crosshair{static_cast<int>(aim_px_[0]), static_cast<int>(aim_px_[1]), kTextColor};
  return options;
}

}  // namespace tactus::firmware
