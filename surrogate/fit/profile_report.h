#pragma once

#include <array>
#include <string>
#include <vector>

#include "surrogate/fit/bekker_fit.h"
#include "surrogate/fit/stress_profile.h"

namespace grouser::surrogate {

/// A run's recorded profile beside the physics', both in the canonical half-space.
struct ProfileRow {
  const Sample* row;
  ComparedProfile compared;
  RimProfile model;
  double sinkage;        ///< of the model [m]
  bool used;             ///< whether a fit would look at it (IsComparable)
  ProfileMisfit misfit;  ///< where used
};

/// Of every row that has a profile.
std::vector<ProfileRow> CompareProfiles(const std::vector<Sample>& rows, const BekkerModel& model,
                                        double smear_rad);

/// Root mean square over the rows used of their misfits: every run counts alike.
ProfileMisfit PooledMisfit(const std::vector<ProfileRow>& rows);

/// What DEM itself differs by from bed to bed: of states with several repeats, the
/// bins' standard deviation over the rms of their mean; root mean square over the
/// states. A perfect model is off by about this from single runs. 0 without repeats.
ProfileMisfit RepeatMisfit(const std::vector<Sample>& repeats, const WheelGeometry& wheel);

/// repeats: RepeatMisfit, for comparison.
std::string ProfilesText(const std::vector<ProfileRow>& rows, const ProfileMisfit& repeats);
/// With the bins, for plots: degrees and Pa.
std::string ProfilesJson(const std::vector<ProfileRow>& rows, const ProfileMisfit& repeats,
                         const std::string& reference);

/// Errors of the physics alone on some runs.
struct PhysicsErrors {
  int runs = 0, profiles = 0;
  std::array<double, kOutputs> rmse{};  ///< over OutputScale
  ProfileMisfit misfit{};
};

/// What a weight of the profiles makes of the physics.
struct WeightTrial {
  double weight;
  BekkerParameters parameters;
  BekkerParameters spread;  ///< jackknife standard error of each parameter
  PhysicsErrors left_out, test;
  double seconds;  ///< of the fit to all runs
};

/// Fits the physics to the training runs for each weight. `left_out`: each of ten
/// groups of states predicted by a fit to the other nine (the weight may be chosen
/// by it); `test`: the runs held out. Spread, of x_g fitted without group g:
///   sqrt((G - 1)/G sum_g (x_g - mean)^2)   (delete-a-group jackknife).
std::vector<WeightTrial> TryWeights(const TrainingSet& set, const std::vector<double>& weights);

std::string WeightsText(const std::vector<WeightTrial>& trials,
                        const std::array<double, kOutputs>& patch);
std::string WeightsJson(const std::vector<WeightTrial>& trials,
                        const std::array<double, kOutputs>& patch);

/// Noise of one placement over OutputScale, as FitModel estimates it.
std::array<double, kOutputs> PatchOf(const TrainingSet& set);

}  // namespace grouser::surrogate
