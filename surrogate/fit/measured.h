#pragma once

#include <string>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/fit/plausible.h"
#include "surrogate/models/hybrid.h"

namespace grouser::surrogate {

/// Measured wheel tests: CSV with '#' comments and a header line that names
/// slip, attack_angle_deg, load_n and any of f_x_n, f_x_sd, f_y_n, f_y_sd,
/// torque_n_m, torque_sd, sinkage_m, sinkage_sd (slip and signs as everywhere
/// here: ToSlip, contact frame). An empty field is not measured. Throws
/// std::invalid_argument "FILE:LINE: COLUMN: VALUE, expected ...", also for what this
/// wheel cannot do (ImpossibleOutput: another unit, another wheel), for a column that
/// stands there twice, for forces that are all below 1e-3 of the load and, unless
/// `accept_unusual`, for angles that all lie within pi/2 degrees: radians? A file *.json is
/// what `grouser validate` wrote (rows.json): its measured values, with standard errors for sd.
std::vector<v1alpha1::MeasuredPoint> ReadMeasured(const std::string& path,
                                                  const WheelLimits& limits,
                                                  bool accept_unusual = false);

/// Whether a model stands for DEM there: slip and angle within its domain, the load within a
/// third of it.
bool InDomain(const v1alpha1::Domain& domain, const v1alpha1::MeasuredPoint& point);

/// One measured point beside what the model and the nearest DEM run say.
struct MeasuredRow {
  const v1alpha1::MeasuredPoint* measured;
  WheelAnswer model;
  const v1alpha1::RunSummary* dem;  ///< null: no run near
};
/// How far a run is from a measured state, 0 to 3; infinite where it is not near: within 0.06 of
/// slip, 3 degrees and 20 % of load.
double DistanceOf(const v1alpha1::RunSummary& run, const v1alpha1::MeasuredPoint& point);

/// With the nearest of the steady runs that are near.
std::vector<MeasuredRow> MatchMeasured(const TabulatedModel& model, double speed,
                                       const std::vector<v1alpha1::MeasuredPoint>& points,
                                       const std::vector<v1alpha1::RunSummary>& runs);

/// rms of model and of DEM minus measurement, by region and output.
struct MeasuredError {
  v1alpha1::Region region;
  int output;
  int n, n_dem;
  double rmse, rmse_dem;  ///< NaN where n is 0
  double mean_measured;
};
std::vector<MeasuredError> MeasuredErrors(const std::vector<MeasuredRow>& rows);

}  // namespace grouser::surrogate
