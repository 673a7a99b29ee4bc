#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "surrogate/calibrate/soil_fit.h"

namespace grouser::surrogate {

inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// A least-squares problem of soil_fit.h: what is fitted with which factor, and what of it is free.
struct Problem {
  const SoilLaw* law;
  std::vector<Observation> fitted;
  std::vector<double> factor;  ///< root of weight, over sigma, of each
  std::vector<int> free;
  std::optional<Pin> pin;

  /// All free coordinates of the fit's law, its sigma and weights.
  explicit Problem(const SoilFit& fit);

  /// `from` with the free coordinates at center + sd u, the pin obeyed.
  Coordinates At(const double* u, const Coordinates& from) const;
  bool Within(const Coordinates& x) const;
};

/// Half of the sum of squares at its minimum, by Ceres from `x` on, which becomes it; infinite
/// where there is nothing usable.
double Minimise(const Problem& problem, Coordinates* x, int iterations);

}  // namespace grouser::surrogate
