#pragma once

#include <array>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/fit/measured.h"
#include "surrogate/models/form_error.h"

namespace grouser::surrogate {

/// DEM minus measurement in each region, from the n rows that were measured there:
///
///   sd^2 = max(M - D, M min(1, sqrt(2/k)))
///
/// M: mean of (model minus measurement)^2, D: that of the variance which the model's own interval
/// against DEM stands for; forces and moments brought to the middle load. k: rows straight ahead,
/// where all are at one angle; in the other regions the attack angles that were measured, to the
/// nearest 5 degrees, since rows of one angle miss alike. What is below the standard error of M, k
/// of them cannot tell from 0. factor: two-sided quantile of Student's t with k degrees of freedom
/// (M is about 0, not about a mean). No row: both NaN.
struct FormEstimate {
  FormErrors form;
  std::array<std::array<int, kOutputs>, kMeasuredRegions> rows{};
};
/// middle_load [N]: of the model; level: of its intervals.
FormEstimate EstimateForm(const std::vector<MeasuredRow>& rows, double middle_load, double level);

/// The model's measured points within its domain, with its answers.
std::vector<MeasuredRow> MeasuredInDomain(const TabulatedModel& model,
                                          const v1alpha1::Model& message);

/// form_by_region from the message's measured points, and sd_form: rms of model minus measurement
/// over all of them; NaN where fewer than three are known.
void SetFormError(const TabulatedModel& model, v1alpha1::Model* message);

/// One attack angle (to the nearest 5 degrees) left out of the estimate: how many of its rows lie
/// inside the intervals of MEASURED that the other angles give.
struct AngleLeftOut {
  double attack_angle_rad;
  Output output;
  int rows = 0;     ///< that have an interval
  int inside = 0;   ///< of these
  int unknown = 0;  ///< whose region has no row at the other angles
};
/// By angle, then by output; outputs that were not measured at an angle are left out.
std::vector<AngleLeftOut> LeaveAnglesOut(const std::vector<MeasuredRow>& rows, double middle_load,
                                         double level);
/// The same over all angles, by output.
std::vector<AngleLeftOut> OverAngles(const std::vector<AngleLeftOut>& each);

}  // namespace grouser::surrogate
