#pragma once

#include <array>
#include <string>
#include <vector>

#include "surrogate/fit/training_set.h"
#include "surrogate/models/hybrid.h"

namespace grouser::surrogate {

/// One comparison of a model with a run.
struct Comparison {
  const Sample* row;
  std::array<double, kOutputs> value, half_width;
};
std::vector<Comparison> CompareRows(const TabulatedModel& model, const std::vector<Sample>& rows);

v1alpha1::Region RegionOf(double slip, double attack_angle_rad);
const char* RegionName(v1alpha1::Region region);
/// Those of an error table; REGION_ALL, the first, has every state.
inline constexpr std::array kRegions = {v1alpha1::REGION_ALL, v1alpha1::REGION_BRAKING,
                                        v1alpha1::REGION_TOWED, v1alpha1::REGION_DRIVING,
                                        v1alpha1::REGION_LATERAL};
bool IsIn(v1alpha1::Region region, double slip, double attack_angle_rad);

/// Rows of the error table by region and output (f_z, which is the load, left
/// out); regions without a run are left out.
std::vector<v1alpha1::ErrorRow> ErrorTable(const std::vector<Comparison>& comparisons,
                                           const std::string& set);

/// A mean outside its own numbers by rounding still counts as inside.
bool Covered(double mean, double value, double half_width);

}  // namespace grouser::surrogate
