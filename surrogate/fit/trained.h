#pragma once

#include <array>
#include <memory>
#include <vector>

#include "surrogate/fit/bekker_fit.h"
#include "surrogate/fit/residual_field.h"

namespace grouser::surrogate {

/// Physics and residual fields as fitted, before the fields become a table.
/// Residuals are over OutputScale.
struct Trained {
  BekkerParameters physics;
  bool with_physics = true;  ///< else the fields are the whole answer
  std::array<FieldSettings, kOutputs> settings;
  std::vector<ResidualField> fields;  ///< one an output
  std::shared_ptr<const HullDistance> distance;
  SpeedAxis speed;  ///< of the fields, its saturation by the likelihood
  double gravity_m_per_s2;
};

struct TrainOptions {
  WheelGeometry wheel;
  BekkerFitOptions physics;   ///< its `patch` is the noise of the fields too
  bool with_residual = true;  ///< false: the bekker kind
  bool with_physics = true;   ///< false: the lookup kind
  SpeedAxis speed;            ///< reference and end, of all runs; may be none
  double gravity_m_per_s2 = 9.81;
};

/// The speed axis of runs at speeds that differ by more than a tenth: reference, the
/// mean of their Froude numbers. None, where they do not differ.
SpeedAxis SpeedAxisOf(const std::vector<Sample>& rows, double radius_m, double gravity_m_per_s2);

/// Fits physics, then the fields to what it leaves, their settings by the likelihood.
/// `warm`: start from its physics and keep its speed axis (cross-validation), or null.
Trained Train(const std::vector<Sample>& rows, const TrainOptions& options, const Trained* warm);

struct Prediction {
  std::array<double, kOutputs> value, physics;
  double distance;  ///< hull distance
};
Prediction Predict(const Trained& trained, const WheelGeometry& wheel, const Sample& at);

/// The table of the fields over [load_min/3, load_max 3]; beyond the training
/// loads it fades to 0 (and the hull distance to 1). Without physics it ends at
/// the training loads, and f_z is the load.
struct Table {
  TableAxes axes;
  TableCoefficients coefficients;
  TableCoefficients rates;  ///< all empty without a speed axis
};
Table Tabulate(const Trained& trained, double load_min_n, double load_max_n);

}  // namespace grouser::surrogate
