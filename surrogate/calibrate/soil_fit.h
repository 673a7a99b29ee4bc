#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "surrogate/calibrate/soil_law.h"

namespace grouser::surrogate {

/// What the law leaves over in one kind of measured number.
struct Misfit {
  TestKind kind;
  int output;              ///< of a wheel; else -1
  int n = 0;               ///< fitted observations
  double dof = 0;          ///< what of them is left beside the parameters
  double share = 0;        ///< sd of the law's own error; over the measured value, or OutputScale
  bool estimated = false;  ///< sds were not stated, do not explain the residuals, or could not show
  bool assumed = false;    ///< too few rows to tell: the typical share
};

/// A reported parameter with what is known of it. Intervals are of 90 %.
struct FittedParameter {
  ReportedParameter what;
  double value, sd;          ///< sd from the Jacobian
  double low, high;          ///< profile likelihood
  bool low_open, high_open;  ///< no end was found within the accepted range
  double typical;            ///< of the prior
  double share_left;         ///< of the prior's uncertainty, after the data: 1: they say nothing
  bool identified;           ///< share_left at most kIdentified
};
inline constexpr double kIdentified = 0.5;

/// What is predicted for an observation, fitted or held out.
struct Predicted {
  double value;
  double sd_soil;  ///< from the uncertainty of the parameters
  /// With the measurement's sd and the law's own error, which counts as much again for each
  /// doubling of sinkage, width, displacement or pressure beyond what was fitted, and for each
  /// half radian from the nearest fitted state of a wheel (by judgement).
  double sd_total;
};

/// Least squares of SoilLaw against the observations that are not held out:
///
///   sum_i w_i ((model - value)/sigma_i)^2 + sum_k ((x_k - center_k)/sd_k)^2,
///   sigma_i^2 = sd_i^2 + (share_g scale_i)^2,
///
/// over the free coordinates within their bounds, by Ceres. w_i: 1, or counts_as over the
/// number of the test's observations. scale_i: SoilLaw::ScaleOf. share_g, the law's own error by
/// kind and output g, is 0 where the stated sds explain the residuals (chi-squared, 1 %) and would
/// not if the law had its typical error; else it is such that
///
///   sum w (residual/sigma)^2 + 2 (typical/share)^2 = degrees of freedom + 2,
///
/// degrees counted by leverage: the typical error counts as two rows, and alone where nothing
/// was fitted.
struct SoilFit {
  std::shared_ptr<const SoilLaw> law;
  Coordinates x;
  std::vector<Misfit> misfits;
  std::vector<double> sigma, weight;  ///< by observation; weight 0: held out
  double cost = 0;                    ///< half of the sum above
  double deviance = 0;         ///< twice the cost, and ln sigma^2: what two forms are compared by
  double dof = 0;              ///< degrees of freedom of the data
  bool sds_estimated = false;  ///< t and F take the place of normal and chi-squared
  Eigen::MatrixXd jacobian;    ///< d model/d x of all observations by the free coordinates
  Eigen::MatrixXd covariance;  ///< of the free coordinates, priors included
  std::vector<Predicted> predicted;

  const BekkerParameters Parameters() const { return law->ParametersOf(x); }
};

/// Throws std::runtime_error when no start leads to a usable solution.
SoilFit FitSoil(const MeasuredSoil& soil, const Typical& typical, double form);

/// The parameters with intervals; correlation of the reported ones, in their order.
std::vector<FittedParameter> ParametersOf(const SoilFit& fit);
Eigen::MatrixXd CorrelationOf(const SoilFit& fit);

/// Twice the cost of the fit with the soil's six coordinates held at `truth`, less the fit's
/// own, and the 90 % quantile of it: `truth` lies in the 90 % region if it is no more.
double DistanceOf(const SoilFit& fit, const BekkerParameters& truth);
double RegionOf(const SoilFit& fit);

}  // namespace grouser::surrogate
