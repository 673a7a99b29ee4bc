#pragma once

#include <array>
#include <memory>
#include <vector>

#include "surrogate/fit/bekker_fit.h"
#include "surrogate/fit/residual_field.h"

namespace grouser::surrogate {

/// Physics and fields as fitted, before the fields become a table. Fields are over
/// OutputScale: of what physics leaves, or of the whole answer, which then is
///   (1 - s) physics + s field, s = FieldShare(distance),
/// so that physics alone answers motions and loads that no run has.
struct Trained {
  BekkerParameters physics;
  bool with_physics = true;  ///< else the fields are the whole answer, s = 1
  bool whole = false;        ///< with physics: whether fields are of the whole answer
  std::array<FieldSettings, kOutputs> settings;
  std::vector<ResidualField> fields;  ///< one an output
  std::shared_ptr<const HullDistance> distance;
  SpeedAxis speed;  ///< of the fields, its saturation by the likelihood
  double gravity_m_per_s2;
};

struct TrainOptions {
  WheelGeometry wheel;
  BekkerFitOptions physics;   ///< its `patch` is the fields' mean noise, too
  bool with_residual = true;  ///< false: the bekker kind
  bool with_physics = true;   ///< false: the lookup kind
  bool whole = false;         ///< with physics: what the fields are of
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
/// 1 to a hull distance of 0.3, falling smoothly to 0 at 0.6 (about Hull::kFarFromRuns).
double FieldShare(double distance);
Prediction Predict(const Trained& trained, const WheelGeometry& wheel, const Sample& at);

/// The table of the fields over [load_min/3, load_max 3]; beyond the training
/// loads it fades to 0 (and the hull distance to 1). Without physics it ends at
/// the training loads. The channel of f_z is the table's share in the answer
/// (ResidualTable::kShare): s of Trained, faded; 0 on physics, 1 without.
struct Table {
  TableAxes axes;
  TableCoefficients coefficients;
  TableCoefficients rates;  ///< all empty without a speed axis
};
Table Tabulate(const Trained& trained, double load_min_n, double load_max_n);

}  // namespace grouser::surrogate
