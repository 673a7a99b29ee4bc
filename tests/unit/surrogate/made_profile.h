#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "surrogate/fit/stress_profile.h"
#include "tests/unit/surrogate/synthetic.h"

namespace grouser::surrogate::synthetic {

inline constexpr double kStep = 0.0872664626;  // 5 degrees
inline constexpr int kBins = 72;

inline Canonical StateOf(const Sample& row) {
  return ToCanonical(row.motion.v_x, row.motion.v_y, row.motion.rim_speed);
}

/// Adds the profile that the truth has: bin means of its stresses, as a wheel seen
/// from the contact frame records them, each with noise of a share of the peak.
inline void AddProfile(const Truth& truth, double noise, std::uint64_t seed,
                       v1alpha1::RunSummary* run) {
  const Sample row = MakeSample(*run);
  const BekkerModel model(truth.physics, kWheel);
  const Canonical state = StateOf(row);
  const double sinkage = model.SolveCanonical(state, row.load_n).value[kSinkage];
  const double mirror = state.sign_x < 0 ? -1 : 1;
  constexpr int kFine = 50;
  std::vector<double> normal(kBins), tangential(kBins);
  double peak = 0, shear = 0;
  for (int i = 0; i < kBins; ++i) {
    for (int k = 0; k < kFine; ++k) {
      const double angle = -M_PI + (i + (k + 0.5) / kFine) * kStep;
      const RimStress at = model.StressAt(state, sinkage, mirror * angle);
      normal[i] += at.normal / kFine;
      tangential[i] += mirror * at.tangential / kFine;
    }
    peak = std::max(peak, normal[i]);
    shear = std::max(shear, std::fabs(tangential[i]));
  }
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal_law(0, 1);
  auto* stress = run->mutable_stress();
  stress->set_first_angle_rad(-M_PI);
  stress->set_angle_step_rad(kStep);
  for (int i = 0; i < kBins; ++i) {
    const bool contact = normal[i] > 0;  // no grain, no noise
    stress->add_normal_pa(normal[i] + (contact ? noise * peak * normal_law(random) : 0));
    stress->add_shear_tangential_pa(tangential[i] +
                                    (contact ? noise * shear * normal_law(random) : 0));
  }
}

}  // namespace grouser::surrogate::synthetic
