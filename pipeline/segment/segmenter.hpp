// The segment stage: colour image in, a distribution over the 23 materials per score pixel out.
//
//   purpose   say what each visible surface is probably made of
//   inputs    one RGB8 image (a keyframe's colour, one frame in 12); any size, fixed at boot
//   outputs   MaterialScores: bytes [y][x][23] at the network's own score resolution (128 x 128 for the
//   ADE20K network) how       stretch to the network's input (no letterbox: the network was trained on
//   stretched squares, and borders would
//             cost a quarter of its resolution), run it, softmax over classes with a temperature, mix the
//             classes' material distributions (class_map.hpp)
//   budget    budgets.hpp; runs on its own low-priority thread, work is the same for every image
//   memory    bytes_needed(); no heap, no lock in step
//   late      the newest keyframe replaces the waiting one (the edge's policy); a result is fused with its
//   keyframe's pose full      cannot be: every buffer has its size from boot lost      not concerned: it
//   knows no poses
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/segment/class_map.hpp"
#include "pipeline/segment/image_resize.hpp"
#include "pipeline/segment/material_scores.hpp"
#include "pipeline/segment/network.hpp"
#include "rt/slice.hpp"
#include "rt/status.hpp"

namespace tactus::segment {

/// Model and map are only looked at during bytes_needed() and bind().
struct SegmenterConfig {
  const Model* model = nullptr;
  const ClassMap* class_map = nullptr;
  int image_width = 640, image_height = 480;
};

class Segmenter {
 public:
  /// Bytes for bind(), without the MaterialScores. Error: as bind(). Phase: boot (builds the network once on
  /// trial).
  static rt::Result<std::size_t> bytes_needed(const SegmenterConfig& config);

  /// Error: the network cannot run (see Network::bind), or the class map has another number of classes than
  /// the network. Phase: boot.
  static rt::Result<Segmenter> bind(const SegmenterConfig& config, rt::Slice memory);

  /// The size of the result.
  [[nodiscard]] int scores_width() const { return network_.scores().shape.width(); }
  [[nodiscard]] int scores_height() const { return network_.scores().shape.height(); }
  [[nodiscard]] const Network& network() const { return network_; }

  /// Runs everything once on a grey image, into `out`. Phase: boot, after bind.
  rt::Status warm_up(MaterialScores& out) noexcept;

  /// `rgb`: image_width * image_height * 3 bytes. `out` must have the size above; its maps are set too.
  /// ok, or corrupt when the network fails (then `out` is unchanged). Phase: step; thread-bound; no heap, no
  /// lock. After the network's scores, the same bytes on every machine (+ - * / and integers in a fixed
  /// order).
  rt::Status step(std::span<const std::uint8_t> rgb, MaterialScores& out) noexcept;

 private:
  explicit Segmenter(Network network) : network_(std::move(network)) {}
  void write_input(std::span<const std::uint8_t> rgb) noexcept;
  void write_scores(MaterialScores& out) const noexcept;

  Network network_;
  ImageResizer resizer_;
  int image_width_ = 0, image_height_ = 0;
  bool is_bgr_ = false;
  float inverse_temperature_ = 1;
  std::span<std::uint8_t> row_;          // one resized row
  std::span<std::uint8_t> input_bytes_;  // 3 x 256: image byte to 8-bit network input, per channel
  std::span<float> input_reals_;         // 3 x 256: the same for a float32 network
  std::span<float> exponentials_;        // 256: exp(-steps * scale / temperature) for 8-bit scores
  std::span<MaterialDistribution> class_materials_;
  std::span<float> weights_;  // per class, of one pixel
};

}  // namespace tactus::segment
