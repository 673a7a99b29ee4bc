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

/// Kernel ridge regression of one channel (equally: the mean of a Gaussian
/// process),
///   k(a, b) = amplitude^2 s(a, b; length) + rate_amplitude^2 u_a u_b s(a, b; rate_length),
///   s(a, b; l) = sum_g chi(g) m(d(a, g b; l)), g over the mirrors {1, x, y, xy},
/// chi the channel's signs, so that the result has the mirror symmetries exactly; m
/// Matern 5/2, d^2 = |e_a - e_b|^2/l^2 + (ln load_a - ln load_b)^2/load_length^2. The
/// mean is thus T + u T_rate. Values fade to 0 away from the data.
struct FieldSettings {
  double length = 0.5;        ///< on the sphere [-]; slip 0 to 1 is 0.77 apart
  double load_length = 1.5;   ///< in ln load
  double amplitude = 0;       ///< prior sd of the residual, 0: no residual
  double lack_of_fit = 0;     ///< sd of what the field does not follow
  double rate_length = 1;     ///< as length, of T_rate
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

/// Ridge strength and lengths by the leave-one-out predictive density (in
/// closed form), over a fixed set of candidates; a rate only where some u is not 0.
struct SelectedField {
  FieldSettings settings;
  double density;  ///< logarithm of the leave-one-out predictive density, all values
};
SelectedField SelectField(const std::vector<FieldPoint>& points, const Eigen::VectorXd& values,
                          const Eigen::VectorXd& noise, ResidualTable::Parity parity);

/// Hull distance: prior share of variance that the runs leave open, as a
/// standard deviation; near 0 at runs, 1 far away.
class HullDistance {
 public:
  HullDistance(std::vector<FieldPoint> points, double length, double load_length);
  double At(const FieldPoint& point) const;

 private:
  std::vector<FieldPoint> points_;
  double length_, load_length_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

}  // namespace grouser::surrogate
