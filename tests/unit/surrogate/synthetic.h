#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "surrogate/fit/fit_model.h"
#include "surrogate/models/bekker.h"

namespace grouser::surrogate::synthetic {

inline constexpr WheelGeometry kWheel{0.0625, 0.05};

/// Runs that never were: a known Bekker model plus a smooth misfit that no
/// Bekker model has, plus seeded noise. For tests of the fitter alone.
struct Truth {
  BekkerParameters physics;
  double misfit = 0;  ///< share of load
  double noise = 0;   ///< standard deviation, share of load (load r, r)

  Truth();
  /// Noise-free outputs at a state.
  std::array<double, kOutputs> At(double slip, double angle, double load) const;
};

v1alpha1::Scene MakeScene();
v1alpha1::RunSummary MakeRun(const Truth& truth, const std::string& id, double slip, double angle,
                             double load, v1alpha1::RunRole role, std::uint64_t seed);
/// 4 slips x 3 attack angles x the given loads, TRAIN.
std::vector<v1alpha1::RunSummary> SmallCampaign(const Truth& truth,
                                                const std::vector<double>& loads);
/// n random states over the same box.
std::vector<v1alpha1::RunSummary> RandomRuns(const Truth& truth, int n, v1alpha1::RunRole role,
                                             std::uint64_t seed, double load_min = 20,
                                             double load_max = 20);
FitRequest MakeRequest(std::vector<v1alpha1::RunSummary> runs);

}  // namespace grouser::surrogate::synthetic
