// `tactus study`: the paper's accuracy study and what explains it, each as one command.
#pragma once

#include <string>

#include "firmware_host/options.hpp"
#include "rt/status.hpp"

namespace tactus::firmware {

/// The four metrics of every method on every set, the paper's rows beside; pictures and accuracy.json in
/// options.out.
rt::Result<std::string> study_accuracy(const StudyOptions& options);

/// What each of the paper's five sources of error costs: every one swapped for the truth in turn.
rt::Result<std::string> study_errors(const StudyOptions& options);

/// Accuracy, processor time and label age when one frame in N goes to the network, and by need.
rt::Result<std::string> study_keyframes(const StudyOptions& options);

/// What the answers to the user study say, with the paper's tests (section V-B); nothing about a room.
rt::Result<std::string> study_stats(const StudyStatsOptions& options);

/// Writes the study's questionnaire as a web page around the clips of a folder; firmware_host/study_form.hpp.
rt::Result<std::string> study_form(const StudyFormOptions& options);

/// Films one script under each of the paper's three conditions (section V-B), all else equal: NAME.mp4 for each and
/// clips.json in options.run.out. device_unavailable where nothing can be drawn or encoded.
rt::Result<std::string> study_clips(const StudyClipsOptions& options);

/// How often what is thrown does as the true material would have it, under each of the three conditions;
/// firmware_host/plausible_throws.hpp says how that is measured. plausibility.json in options.out.
rt::Result<std::string> study_plausibility(const StudyPlausibilityOptions& options);

}  // namespace tactus::firmware
