#pragma once

#include <set>
#include <string>
#include <vector>

#include "surrogate/calibrate/soil_fit.h"

namespace grouser::surrogate {

/// A test that was not made, and its rows; their values are left open.
struct Candidate {
  std::string text;
  MeasuredTest test;
  std::vector<Observation> rows;
};

/// What was fitted, as far as advice depends on it.
struct Made {
  std::set<double> widths, pressures;
  double depth = 0;
  int wheels = 0, presses = 0, shears = 0;
  const MeasuredTest* wheel = nullptr;
  double load = 0, displacement = 0;
};
Made MadeOf(const MeasuredSoil& soil);
/// "plates of one width (b = 30 mm) and a wheel pressed down": the subject of a sentence.
std::string TestsMade(const Made& made);

/// Another plate, a deeper one, shear at other pressures, and where there is a wheel driven, braked
/// and skewed ones. Keeps nothing of `made`.
std::vector<Candidate> CandidatesFor(const SoilFit& fit, const Made& made);

}  // namespace grouser::surrogate
