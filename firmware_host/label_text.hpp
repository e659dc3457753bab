// Label metrics as text and JSON, the same for every command that prints them.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "firmware_host/label_scores.hpp"
#include "pipeline/evaluate/labels.hpp"

namespace tactus::firmware {

/// One line per method under a heading: the four metrics in per cent, over all pixels, over those that every
/// method labels, in the band around the truth's boundaries and away from it; then islands, and the cells of
/// the map.
std::string scores_text(const StudyScores& scores);
nlohmann::json scores_json(const StudyScores& scores);

/// Which solver fused_crf3d is by, and how near the incremental one came to the batch solver: a line, and a
/// second one, plain, where that is less than kCrfAgreementMin.
std::string crf_text(const CrfOutcome& crf);
nlohmann::json crf_json(const CrfOutcome& crf);

/// The materials whose truth has pixels, a row each, in per cent of the row; columns are what they were taken
/// for.
std::string confusion_text(const evaluate::ConfusionMatrix& confusion);

}  // namespace tactus::firmware
