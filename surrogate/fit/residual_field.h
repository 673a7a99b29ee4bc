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

/// Distances at which two states have little to do with one another. With the direction
/// (p, y, q) of a state, those of
struct Lengths {
  double slip = 1;     ///< (p - q)/sqrt 2: slip 0 to 1 is 0.5 apart
  double roll = 1;     ///< (p + q)/sqrt 2
  double lateral = 1;  ///< y: 0 to 90 degrees is 1 apart
  double load = 3;     ///< ln load
  // The attack angle's cosine and sine, regular where the hub rests.
  double ahead = 2;  ///< p/sqrt(p^2 + y^2 + 0.04)
  double aside = 2;  ///< y/sqrt(p^2 + y^2 + 0.04)
  // Whither the rim's lowest point slides, which friction opposes.
  double sliding = 2;  ///< (p - q, y)/sqrt((p - q)^2 + y^2 + 0.05)

  static constexpr int kAxes = 7;
  std::array<double, kAxes> All() const {
    return {slip, roll, lateral, load, ahead, aside, sliding};
  }
  static Lengths Of(const std::array<double, kAxes>& l) {
    return {l[0], l[1], l[2], l[3], l[4], l[5], l[6]};
  }
};

/// Gaussian process of one channel,
///   k(a, b) = (amplitude^2 + rate_amplitude^2 u_a u_b) sum_g chi(g) m(d(a, g b)),
/// g over the mirrors {1, x, y, xy}, chi the channel's signs, so that the result has
/// the mirror symmetries exactly; m Matern 5/2, d over Lengths. Its mean is
/// T + u T_rate. Values fade to 0 away from the data.
struct FieldSettings {
  Lengths lengths;
  double amplitude = 0;       ///< prior sd of the residual, 0: no residual
  double lack_of_fit = 0;     ///< sd of what the field does not follow
  double rate_amplitude = 0;  ///< prior sd of T_rate, 0: none
};

/// What the kernel compares: Lengths' coordinates, the two of `sliding` last.
using FieldCoordinates = std::array<double, Lengths::kAxes + 1>;

/// The sums over mirrors for all pairs of points, and their slopes by ln of each length.
class PairKernel {
 public:
  PairKernel(const std::vector<FieldPoint>& points, ResidualTable::Parity parity);
  Eigen::MatrixXd At(const Lengths& lengths) const;
  Eigen::MatrixXd At(const Lengths& lengths,
                     std::array<Eigen::MatrixXd, Lengths::kAxes>* slopes) const;

 private:
  static constexpr int kMirrors = 4;
  std::array<double, kMirrors> sign_;
  std::array<std::array<Eigen::MatrixXd, Lengths::kAxes>, kMirrors> squares_;
};

/// Squares of the noise's sds, on the covariance's diagonal.
Eigen::VectorXd NoiseVariance(const Eigen::VectorXd& noise, const FieldSettings& settings);

class ResidualField {
 public:
  /// `noise`: sd of each value besides lack_of_fit.
  ResidualField(std::vector<FieldPoint> points, const Eigen::VectorXd& values,
                const Eigen::VectorXd& noise, ResidualTable::Parity parity,
                const FieldSettings& settings);

  double Mean(const FieldPoint& at) const;  ///< T + u T_rate
  struct Terms {
    double table, rate;  ///< T, T_rate
  };
  Terms At(const FieldPoint& at) const;

 private:
  std::vector<FieldPoint> points_;
  std::vector<FieldCoordinates> coordinates_;
  ResidualTable::Parity parity_;
  FieldSettings settings_;
  Eigen::VectorXd weights_;
};

/// Lengths, amplitudes and lack of fit at the largest marginal likelihood (Rasmussen &
/// Williams 2006, eq. 2.30) times a prior: logarithms of lengths normal about those of
/// Lengths{} with sd 0.7 (of ahead, aside and sliding 1), of the others with sd 1 about 0.7
/// (amplitude) and 0.03 (lack of fit) of the values' root mean square, and 0.2 of the amplitude for
/// what the speed does; a rate only where some u is not 0. Quasi-Newton steps (L-BFGS) from two
/// starts. No field (amplitude 0) where white noise is as likely.
struct SelectedField {
  FieldSettings settings;
  double likelihood;  ///< logarithm of that product, but for a constant
};
SelectedField SelectField(const std::vector<FieldPoint>& points, const Eigen::VectorXd& values,
                          const Eigen::VectorXd& noise, ResidualTable::Parity parity);

/// Hull distance: prior share of variance that the runs leave open, as a
/// standard deviation; near 0 at runs, 1 far away.
class HullDistance {
 public:
  HullDistance(const std::vector<FieldPoint>& points, const Lengths& lengths);
  double At(const FieldPoint& point) const;

 private:
  std::vector<FieldCoordinates> coordinates_;
  Lengths lengths_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

}  // namespace grouser::surrogate
