#include "dem_offline/engine/rig/scaling.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/preparation.h"
#include "dem_offline/engine/rig/steady.h"

namespace grouser::dem {
namespace {

constexpr double kHertzPacking = 2.6;  // of delta/R = 2.6 (p/E*)^(2/3)
// Measured on runs of 24 and 60 N, moduli 5e6 and 2e7 Pa: the 99th percentile over the whole bed is
// 0.88 to 0.97 times what the mean pressure under the wheel predicts. Taken as 1, on the safe side.
constexpr double kPercentileOverMean = 1;
// m omega^2 / k of the fastest modes of a packed grain, fitted to where wheel tests lose their
// energy: one that contacts damp, and one that they hardly do.
constexpr double kFastestMode = 16, kUndampedMode = 28;
constexpr double kPairOverRigid = 0.354;  // stiffness of two equal grains over grain and rigid body
constexpr double kSafety = 0.75;

void Positive(const char* field, double v) {
  if (!(v > 0) || !std::isfinite(v)) {
    throw std::invalid_argument(std::string(field) + ": " + std::to_string(v) + ", expected > 0");
  }
}

}  // namespace

double MeanPressure(const WheelShape& wheel, double load_n, double sinkage_m) {
  Positive("wheel.radius_m", wheel.radius_m);
  Positive("wheel.width_m", wheel.width_m);
  Positive("load_n", load_n);
  Positive("sinkage_m", sinkage_m);
  return load_n / (wheel.width_m * ContactLength(wheel.radius_m, sinkage_m));
}

double OverlapUnder(double pressure_pa, double youngs_modulus_pa, double poisson_ratio) {
  const double effective = youngs_modulus_pa / (2 * (1 - poisson_ratio * poisson_ratio));
  return kHertzPacking * std::pow(pressure_pa / effective, 2.0 / 3.0);
}

double ModulusForOverlap(const WheelShape& wheel, double load_n, double sinkage_m,
                         double poisson_ratio, double overlap_over_radius) {
  Positive("overlap_over_radius", overlap_over_radius);
  const double mean = overlap_over_radius / kPercentileOverMean;
  const double effective =
      MeanPressure(wheel, load_n, sinkage_m) * std::pow(kHertzPacking / mean, 1.5);
  return 2 * (1 - poisson_ratio * poisson_ratio) * effective;
}

double DampedLimit(double restitution) {
  const double log_e = std::log(std::clamp(restitution, 1e-3, 1.0));
  const double pair = std::sqrt(5.0 / 6) * -log_e / std::hypot(M_PI, log_e);
  const double mode = pair * std::sqrt(0.5 * kFastestMode);
  return 2 * (std::hypot(1, mode) - mode);
}

double LargestStep(const GrainSoil& soil, const WheelShape& wheel, double overlap_over_radius) {
  Positive("overlap_over_radius", overlap_over_radius);
  const ContactModel contacts = RigContacts(soil, wheel);
  double slowest = 1e300;  // smallest sqrt(m/k) of a pair of equal grains
  for (const SizeBin& bin : soil.sizes) {
    const double r = 0.5 * bin.diameter_m;
    const double mass = soil.density_kg_per_m3 * 4.0 / 3.0 * M_PI * r * r * r;
    const double rigid = contacts.Stiffness(overlap_over_radius * r, r, mass);
    slowest = std::min(slowest, std::sqrt(mass / (kPairOverRigid * rigid)));
  }
  const double limit = std::min(DampedLimit(soil.restitution) / std::sqrt(kFastestMode),
                                2 / std::sqrt(kUndampedMode));
  return kSafety * limit * slowest;
}

double ExperimentStep(const WheelTestSpec& spec) {
  if (!spec.rig.scene.largest_step) return BedStep(BedOf(spec));
  return LargestStep(spec.soil, spec.wheel,
                     LoadedOverlap(spec.soil, spec.wheel, spec.state.load_n));
}

double LoadedOverlap(const GrainSoil& soil, const WheelShape& wheel, double load_n) {
  const double pressure = MeanPressure(wheel, load_n, 0.2 * wheel.radius_m);
  return OverlapUnder(pressure, soil.youngs_modulus_pa, soil.poisson_ratio);
}

}  // namespace grouser::dem
