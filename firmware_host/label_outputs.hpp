// What a study of labels leaves behind in files.
#pragma once

#include <array>
#include <filesystem>
#include <span>

#include "firmware_host/label_methods.hpp"

namespace tactus::firmware {

/// `folder`/METHOD for each method that will run. failed when one cannot be made. Boot.
rt::Result<void> make_prediction_folders(const std::filesystem::path& folder,
                                         const std::array<bool, kLabelMethodsCount>& has_method);

/// `folder`/METHOD/NAME.png, 8-bit material ids, 255 unknown.
rt::Result<void> save_predictions(const std::filesystem::path& folder, const LabelStudy& study);

/// Cells with unary costs and true labels, as the CRF's fitting tool reads them
/// (tests/bench/crf_points_file.hpp): "TACTCRF1", u32 number of cells, u32 23, then per cell f32 x 3
/// position, f32 x 3 normal, u8 x 3 colour, u8 true material (255 unknown), f32 x 23 unary cost in nats;
/// little endian.
rt::Result<void> save_points(const std::filesystem::path& file, std::span<const map::SurfaceCell> cells,
                             std::span<const MaterialId> truth);

}  // namespace tactus::firmware
