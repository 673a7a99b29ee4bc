#pragma once

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "surrogate/fit/training_set.h"
#include "surrogate/model_io/write_model.h"
#include "surrogate/models/residual_table.h"

namespace grouser::surrogate {

/// A wheel state where the residual lives: the canonical direction of
/// (v_x, v_y, r w) on the unit sphere, and ln load; SpeedAxis' u.
struct FieldPoint {
  std::array<double, 3> direction;
  double log_load;
  double u = 0;
};
FieldPoint MakeFieldPoint(const Canonical& state, double load_n);
FieldPoint MakeFieldPoint(const ChartPoint& chart, double log_load);

/// Distances at which two states have little to do with one another.
struct Lengths {
  double plane = 0.5;    ///< along v_x and r w on the sphere [-]; slip 0 to 1 is 0.77 apart
  double lateral = 0.5;  ///< along v_y on the sphere [-]; 0 to 90 degrees is 1 apart
  double load = 1.5;     ///< in ln load
};

/// Kernel ridge regression of one channel (equally: the mean of a Gaussian
/// process),
///   k(a, b) = (amplitude^2 + rate_amplitude^2 u_a u_b) sum_g chi(g) m(d(a, g b)),
/// g over the mirrors {1, x, y, xy}, chi the channel's signs, so that the result has
/// the mirror symmetries exactly; m Matern 5/2, d over Lengths. The mean is
/// T + u T_rate. Values fade to 0 away from the data.
struct FieldSettings {
  Lengths lengths;
  double amplitude = 0;       ///< prior sd of the residual, 0: no residual
  double lack_of_fit = 0;     ///< sd of what the field does not follow
  double rate_amplitude = 0;  ///< prior sd of T_rate, 0: none
};

class ResidualField {
 public:
  /// `noise`: sd of each value besides lack_of_fit.
  ResidualField(std::vector<FieldPoint> points, const Eigen::VectorXd& values,
                const Eigen::VectorXd& noise, ResidualTable::Parity parity,
                const FieldSettings& settings);

  double Mean(const FieldPoint& at) const;  ///< T + u T_rate
  double Rate(const FieldPoint& at) const;  ///< T_rate

 private:
  std::vector<FieldPoint> points_;
  ResidualTable::Parity parity_;
  FieldSettings settings_;
  Eigen::VectorXd weights_;
};

/// Lengths, amplitudes and ridge by the marginal likelihood (Rasmussen & Williams
/// 2006, eq. 2.30), over a fixed set of candidates whose lateral length is no shorter
/// than the other; a rate only where some u is not 0.
struct SelectedField {
  FieldSettings settings;
  double likelihood;  ///< its logarithm, but for a constant
};
SelectedField SelectField(const std::vector<FieldPoint>& points, const Eigen::VectorXd& values,
                          const Eigen::VectorXd& noise, ResidualTable::Parity parity);

/// Hull distance: prior share of variance that the runs leave open, as a
/// standard deviation; near 0 at runs, 1 far away.
class HullDistance {
 public:
  HullDistance(std::vector<FieldPoint> points, const Lengths& lengths);
  double At(const FieldPoint& point) const;

 private:
  std::vector<FieldPoint> points_;
  Lengths lengths_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

}  // namespace grouser::surrogate
