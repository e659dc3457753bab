#include "firmware_host/presenter.hpp"

namespace tactus::firmware {

Presenter::Presenter(const PresenterParts& parts) : parts_(parts) {
  if (parts.input != nullptr) {
    const hal::DisplayFormat format = parts.display->format();
    hand_.emplace(*parts.input, parts.app, format.width_px, format.height_px);
  }
}

void Presenter::begin_round(Pipeline& pipeline) {
  if (hand_) hand_->obey(pipeline);
}

void Presenter::draw(Pipeline& pipeline, rt::Clock clock) {
  PictureOptions options;
  if (hand_) options = hand_->picture(pipeline);
  options.predicts_pose = parts_.is_seen;
  const rt::Status status = pipeline.render_round(clock, options);
  if (status == rt::Status::device_lost) {
    is_lost_ = true;
    notes_.push_back({Note::Kind::warning, "The display went away after " + std::to_string(pictures_drawn_) +
                                               " pictures; the run went on without it" +
                                               (parts_.recorder != nullptr && parts_.recorder->has_pictures()
                                                    ? ", and video.mp4 stands still from there."
                                                    : ".")});
    return;
  }
  if (status == rt::Status::ok) ++pictures_drawn_;
}

void Presenter::end_round(Pipeline& pipeline, rt::Clock clock, std::uint64_t frame_number) {
  const auto frame = pipeline.viewed_frame();
  if (!frame || drawn_sequence_ == frame->sequence) return;
  drawn_sequence_ = frame->sequence;
  if (!first_time_) first_time_ = frame->time;
  if (parts_.draws_every_frame && parts_.display != nullptr && !is_lost_) draw(pipeline, clock);
  if (parts_.recorder != nullptr) {
    const double index = (frame->time - *first_time_).seconds() * parts_.frame_rate_hz + 0.5;
    (void)parts_.recorder->offer(static_cast<std::uint64_t>(index), pipeline.picture());  // counted there
  }
  if (parts_.pictures != nullptr && !is_lost_) parts_.pictures->consider(pipeline, clock, frame_number);
}

void Presenter::release() {
  if (parts_.display != nullptr) parts_.display->release();
}

}  // namespace tactus::firmware
