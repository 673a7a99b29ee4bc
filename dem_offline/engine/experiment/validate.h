#pragma once

#include "dem_offline/engine/experiment/experiment.h"

namespace grouser::dem::experiment {

/// Throw SpecError for what cannot be; nothing is allocated that grows with the experiment.
/// `e` is Resolved.
void Validate(const Experiment& e, const WorkLimits& limits);
/// An error of a bed's spec, named as a group of grains of an experiment file names it.
SpecError InGrains(const SpecError& error, const std::string& at);
void CheckFrames(const Experiment& e);       ///< times of frames, and how many
void CheckCheckpoints(const Experiment& e);  ///< whether they are possible
/// Bodies and rain that move more than a tenth of the smallest radius in a step.
void ValidateSpeeds(const Experiment& e, double dt_s);

}  // namespace grouser::dem::experiment
