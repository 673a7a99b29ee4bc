#include "surrogate/soils/traction_numerics.h"

#include <cmath>
#include <limits>

namespace grouser::surrogate {
namespace {
constexpr double kNotSaid = std::numeric_limits<double>::quiet_NaN();

bool IsDriven(double slip) { return slip >= 0 && slip <= 1; }
}  // namespace

double WheelNumeric(const NumericWheel& w, const ConeStrength& cone) {
  return cone.index_pa * w.width_m * w.diameter_m / w.load_n;
}

double BrixiusNumeric(const NumericWheel& w, const ConeStrength& cone) {
  return WheelNumeric(w, cone) * (1 + 5 * w.deflection) / (1 + 3 * w.width_m / w.diameter_m);
}

double SandNumeric(const NumericWheel& w, const ConeStrength& cone) {
  return cone.gradient_pa_per_m * std::pow(w.width_m * w.diameter_m, 1.5) / w.load_n * w.deflection;
}

double PressureOverCone(const NumericWheel& w, const ConeStrength& cone) {
  const double a = w.deflection * w.section_height_m + 0.026 * w.diameter_m;
  const double area = 2 * w.width_m * std::sqrt(w.diameter_m * a - a * a) *
                      std::pow(w.width_m / w.section_height_m, 0.52);
  return w.load_n / area / cone.index_pa;
}

TractionRatios WismerLuth(const NumericWheel& wheel, const ConeStrength& cone, double slip) {
  if (!IsDriven(slip)) return {kNotSaid, kNotSaid};
  const double cn = WheelNumeric(wheel, cone);
  return {0.75 * (1 - std::exp(-0.3 * cn * slip)), 1.2 / cn + 0.04};
}

TractionRatios Brixius(const NumericWheel& wheel, const ConeStrength& cone, double slip) {
  if (!IsDriven(slip)) return {kNotSaid, kNotSaid};
  const double bn = BrixiusNumeric(wheel, cone);
  return {0.88 * (1 - std::exp(-0.1 * bn)) * (1 - std::exp(-7.5 * slip)) + 0.04,
          1 / bn + 0.04 + 0.5 * slip / std::sqrt(bn)};
}

TractionRatios SandByNumeric(const NumericWheel& wheel, const ConeStrength& cone, double slip) {
  const double ns = SandNumeric(wheel, cone);
  if (!IsDriven(slip) || slip == 0 || !(ns > 0)) return {kNotSaid, kNotSaid};
  constexpr double kX = 0.66;
  const double y = 4.71 + 1.72 / slip;
  return {kX - kX * y / (ns + 10 + y), kNotSaid};
}

TractionRatios MasonSand(const NumericWheel& wheel, const ConeStrength& cone, double slip) {
  const double q = PressureOverCone(wheel, cone);
  const double most = 0.42 + 0.009 / q, a = 0.76 + 0.014 / q, c = 1.56 - 0.022 / q;
  const auto gross = [&](double s) {
    return -0.5 + (most + 0.5) / std::pow(1 + a * std::exp(-7 * s), 1 / c);
  };
  if (!(std::fabs(slip) <= 1) || !(c > 0) || !(gross(0) >= 0)) return {kNotSaid, kNotSaid};
  const double resistance = slip >= 0 ? 0.4 * q + 0.6 * slip - 0.03 : 0.21 * q - 0.75 * slip + 0.04;
  return {gross(slip), resistance >= 0 ? resistance : kNotSaid};
}

}  // namespace grouser::surrogate
