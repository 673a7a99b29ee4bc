// Intervals, correlations and regions around a fit.
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <optional>

#include "surrogate/calibrate/least_squares.h"
#include "surrogate/calibrate/soil_fit.h"

namespace grouser::surrogate {
namespace {

constexpr double kLevel = 0.9;

// Where one free parameter's quantile of twice the cost's rise lies.
double IntervalRise(const SoilFit& fit) {
  if (!fit.sds_estimated) return kTwoSided90 * kTwoSided90;
  const boost::math::students_t t(std::max(1.0, fit.dof));
  return std::pow(quantile(t, 0.5 + kLevel / 2), 2);
}

/// Walks away from the fit along one reported parameter, all others refitted.
class Profile {
 public:
  Profile(const SoilFit& fit, int parameter)
      : fit_(fit), parameter_(parameter), what_(fit.law->Reported()[parameter]) {}

  /// sign of the root of the rise of twice the cost at `by` away (in the coordinate, or for a
  /// modulus in the parameter) less the quantile's root.
  double Over(double by, Coordinates* warm) const {
    Problem problem(fit_);
    const int held = what_.coordinate >= 0 ? what_.coordinate : static_cast<int>(kModulusShare);
    std::erase(problem.free, held);
    if (what_.coordinate >= 0) {
      (*warm)[held] = fit_.x[held] + by;
    } else {
      problem.pin = {parameter_, fit_.law->ReportedValue(parameter_, fit_.x) + by};
    }
    const double cost = Minimise(problem, warm, 30);
    if (!std::isfinite(cost)) return kInfinite;
    return std::sqrt(std::max(0.0, 2 * (cost - fit_.cost))) - std::sqrt(IntervalRise(fit_));
  }

  /// How far the parameter may go in a direction; none: as far as is accepted.
  std::optional<double> End(double direction, double sd) const {
    double room = kInfinite;
    if (what_.coordinate >= 0) {
      const Prior& prior = fit_.law->priors()[what_.coordinate];
      room = direction > 0 ? prior.high - fit_.x[what_.coordinate]
                           : fit_.x[what_.coordinate] - prior.low;
    }
    Coordinates warm = fit_.x, inner = fit_.x;
    double in = 0, in_over = -std::sqrt(IntervalRise(fit_));
    double out = 0, out_over = -1;
    double stride = std::max(1e-12, 1.3 * kTwoSided90 * sd);
    for (int step = 0; step < 12; ++step, stride *= 1.6) {
      out = std::min(room, in + stride);
      warm = inner;
      out_over = Over(direction * out, &warm);
      if (out_over >= 0) break;
      if (out >= room) return std::nullopt;
      in = out, in_over = out_over, inner = warm;
    }
    if (out_over < 0) return std::nullopt;
    for (int step = 0; step < 12 && out - in > 2e-3 * out; ++step) {
      double share = std::isfinite(out_over) ? -in_over / (out_over - in_over) : 0.5;
      if (step % 3 == 2) share = 0.5;
      const double middle = in + std::clamp(share, 0.03, 0.97) * (out - in);
      warm = inner;
      const double over = Over(direction * middle, &warm);
      if (std::abs(over) < 1e-3) return middle;
      if (over < 0) {
        in = middle, in_over = over, inner = warm;
      } else {
        out = middle, out_over = over;
      }
    }
    return 0.5 * (in + out);
  }

 private:
  const SoilFit& fit_;
  int parameter_;
  ReportedParameter what_;
};

// d reported/d x of the free coordinates.
Eigen::MatrixXd ReportedSlopes(const SoilFit& fit) {
  const SoilLaw& law = *fit.law;
  const auto rows = static_cast<Eigen::Index>(law.Reported().size());
  const auto columns = static_cast<Eigen::Index>(law.free().size());
  Eigen::MatrixXd slopes(rows, columns);
  for (Eigen::Index c = 0; c < columns; ++c) {
    const double step = 1e-5 * law.priors()[law.free()[c]].sd;
    Coordinates up = fit.x, down = fit.x;
    up[law.free()[c]] += step;
    down[law.free()[c]] -= step;
    for (Eigen::Index r = 0; r < rows; ++r) {
      const int i = static_cast<int>(r);
      slopes(r, c) = (law.ReportedValue(i, up) - law.ReportedValue(i, down)) / (2 * step);
    }
  }
  return slopes;
}

Coordinates Centers(const SoilLaw& law) {
  Coordinates x;
  for (int c = 0; c < kCoordinates; ++c) x[c] = law.priors()[c].center;
  return x;
}

}  // namespace

std::vector<FittedParameter> ParametersOf(const SoilFit& fit) {
  const SoilLaw& law = *fit.law;
  const Eigen::MatrixXd slopes = ReportedSlopes(fit);
  const Eigen::MatrixXd covariance = slopes * fit.covariance * slopes.transpose();
  Eigen::VectorXd prior_variance(law.free().size());
  for (std::size_t c = 0; c < law.free().size(); ++c) {
    prior_variance[static_cast<Eigen::Index>(c)] = std::pow(law.priors()[law.free()[c]].sd, 2);
  }
  const Coordinates typical = Centers(law);
  std::vector<FittedParameter> parameters;
  for (int i = 0; i < static_cast<int>(law.Reported().size()); ++i) {
    const ReportedParameter& what = law.Reported()[i];
    FittedParameter p{what,
                      law.ReportedValue(i, fit.x),
                      std::sqrt(covariance(i, i)),
                      0,
                      0,
                      false,
                      false,
                      law.ReportedValue(i, typical),
                      1,
                      false};
    // A modulus is known as well as the share of it, once the pressure is.
    const int held = what.coordinate >= 0 ? what.coordinate : static_cast<int>(kModulusShare);
    const auto at = std::ranges::find(law.free(), held) - law.free().begin();
    p.share_left = std::sqrt(fit.covariance(at, at) / prior_variance[at]);
    p.identified = p.share_left <= kIdentified;
    const Profile profile(fit, i);
    const double sd = what.coordinate >= 0 ? std::sqrt(fit.covariance(at, at)) : p.sd;
    const auto to = [&](double by) {
      if (what.coordinate < 0) return p.value + by;
      Coordinates x = fit.x;
      x[held] += by;
      return law.ReportedValue(i, x);
    };
    const Prior& prior = law.priors()[held];
    const auto down = profile.End(-1, sd), up = profile.End(1, sd);
    p.low_open = !down;
    p.high_open = !up;
    const bool modulus = what.coordinate < 0;
    p.low = down ? to(-*down) : modulus ? -kInfinite : to(prior.low - fit.x[held]);
    p.high = up ? to(*up) : modulus ? kInfinite : to(prior.high - fit.x[held]);
    parameters.push_back(p);
  }
  return parameters;
}

Eigen::MatrixXd CorrelationOf(const SoilFit& fit) {
  const Eigen::MatrixXd slopes = ReportedSlopes(fit);
  const Eigen::MatrixXd covariance = slopes * fit.covariance * slopes.transpose();
  const Eigen::VectorXd sd = covariance.diagonal().cwiseMax(1e-300).cwiseSqrt();
  return sd.cwiseInverse().asDiagonal() * covariance * sd.cwiseInverse().asDiagonal();
}

double DistanceOf(const SoilFit& fit, const BekkerParameters& truth) {
  Problem problem(fit);
  std::erase_if(problem.free, [](int c) { return c < kSoilCoordinates; });
  const Coordinates of_truth = fit.law->CoordinatesOf(truth);
  Coordinates x = fit.x;
  std::copy_n(of_truth.begin(), kSoilCoordinates, x.begin());
  return 2 * (Minimise(problem, &x, 60) - fit.cost);
}

double RegionOf(const SoilFit& fit) {
  if (!fit.sds_estimated) {
    return quantile(boost::math::chi_squared(kSoilCoordinates), kLevel);
  }
  const boost::math::fisher_f f(kSoilCoordinates, std::max(1.0, fit.dof));
  return kSoilCoordinates * quantile(f, kLevel);
}

}  // namespace grouser::surrogate
