#pragma once

#include <string>
#include <vector>

#include "surrogate/calibrate/identify.h"
#include "surrogate/calibrate/soil_fit.h"

namespace grouser::surrogate {

/// Fitted and predicted rows of one kind of number in one test, apart.
struct ErrorSummary {
  int test, output;
  int fitted = 0, held_out = 0;
  double fitted_rms = 0, held_out_rms = 0;  ///< model minus measured, SI; NaN without rows
  double covered = 0;                       ///< share of the held-out within 90 % intervals
};

/// What `grouser calibrate soil` finds.
struct SoilCalibration {
  MeasuredSoil soil;
  std::shared_ptr<const SoilFit> fit;              ///< of the form that was chosen
  std::shared_ptr<const SoilFit> bekker;           ///< what the soil file holds
  double bekker_deviance = 0, reece_deviance = 0;  ///< NaN: not fitted
  std::string why_form;
  std::vector<FittedParameter> parameters;
  std::vector<FittedParameter> bekker_parameters;
  std::vector<FittedParameter> reece_parameters;  ///< none: not fitted
  Eigen::MatrixXd correlation;
  std::vector<Direction> directions;
  std::vector<NextTest> next_tests;
  std::vector<ErrorSummary> errors;
};

/// `form`: "bekker", "reece" or "auto": Reece's where it is better by a deviance of at least 2 and
/// plates or wheels of two widths tell the forms apart at all, else Bekker's.
SoilCalibration CalibrateSoil(MeasuredSoil soil, const Typical& typical, const std::string& form);

/// A line of the table of soils for what reads surrogate/soils/bekker_soils.csv. K is left out
/// where the data do not identify it; its source names what they do not.
Soil SoilOf(const SoilCalibration& calibration);
/// That line below the table's header, and what it was made of as comments.
std::string SoilFileText(const SoilCalibration& calibration, const std::string& command);

/// What was read, SI, without a fit.
std::string RowsJson(const MeasuredSoil& soil);
std::string CalibrationText(const SoilCalibration& calibration);
std::string CalibrationJson(const SoilCalibration& calibration, const std::string& command);

}  // namespace grouser::surrogate
