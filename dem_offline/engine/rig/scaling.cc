#include "dem_offline/engine/rig/scaling.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/laws/time_step.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/preparation.h"
#include "dem_offline/engine/rig/steady.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
namespace {

constexpr double kHertzPacking = 2.6;  // of delta/R = 2.6 (p/E*)^(2/3)
// The same in force: F = 4/3 E* sqrt(r/2) (2.6 r)^(3/2) p/E* on a contact of grains of radius r.
const double kForceUnderPressure = 4.0 / 3 * std::sqrt(0.5) * std::pow(kHertzPacking, 1.5);
constexpr double kSafety = 0.75;

double MassOf(const GrainSoil& soil, double radius_m) {
  return soil.density_kg_per_m3 * 4.0 / 3.0 * M_PI * radius_m * radius_m * radius_m;
}

void Positive(const char* field, double v) {
  if (!(v > 0) || !std::isfinite(v)) {
    throw std::invalid_argument(std::string(field) + ": " + std::to_string(v) + ", expected > 0");
  }
}

/// Largest step [s] that the laws bear at this overlap over the radius: the least
/// PackedLimit over the sizes.
double StepOfLaws(const GrainSoil& soil, const ContactModel& contacts, double overlap_over_radius) {
  Positive("overlap_over_radius", overlap_over_radius);
  double least = 1e300;
  for (const SizeBin& bin : soil.sizes) {
    const double r = 0.5 * bin.diameter_m;
    least = std::min(least, PackedLimit(contacts, overlap_over_radius, r, MassOf(soil, r)));
  }
  return least;
}

double StepWithin(const GrainSoil& soil, const ContactModel& contacts, double rayleigh_fraction,
                  double overlap_over_radius) {
  const double rayleigh = RayleighTime(SmallestRadius(soil), soil.density_kg_per_m3,
                                       soil.youngs_modulus_pa, soil.poisson_ratio);
  return std::min(rayleigh_fraction * rayleigh, StepOfLaws(soil, contacts, overlap_over_radius));
}

/// Overlap of two touching grains over their radius under a pressure, by the
/// soil's own laws: that at which they bear 4/3 sqrt(1/2) 2.6^(3/2) p r^2. For Hertz
/// and spheres of about one size: delta/R = 2.6 (p/E*)^(2/3), E* = E/(2 (1 - nu^2)).
/// Measured at 24 and 60 N and moduli of 5e6 and 2e7 Pa, the 99th percentile over a whole
/// bed is 0.88 to 0.97 times what the mean pressure under the wheel predicts.
double OverlapUnder(const GrainSoil& soil, const ContactModel& contacts, double pressure_pa) {
  Positive("pressure_pa", pressure_pa);
  const double r = SmallestRadius(soil);
  return OverlapUnderForce(contacts, kGrainMaterial, kForceUnderPressure * pressure_pa * r * r, r,
                           MassOf(soil, r));
}

}  // namespace

double MeanPressure(const WheelShape& wheel, double load_n, double sinkage_m) {
  Positive("wheel.radius_m", wheel.radius_m);
  Positive("wheel.width_m", wheel.width_m);
  Positive("load_n", load_n);
  Positive("sinkage_m", sinkage_m);
  return load_n / (wheel.width_m * ContactLength(wheel.radius_m, sinkage_m));
}

double LargestStep(const GrainSoil& soil, const WheelShape& wheel, double overlap_over_radius) {
  return kSafety * StepOfLaws(soil, RigContacts(soil, wheel), overlap_over_radius);
}

double StepWithin(const GrainSoil& soil, const WheelShape& wheel, double rayleigh_fraction,
                  double overlap_over_radius) {
  return StepWithin(soil, RigContacts(soil, wheel), rayleigh_fraction, overlap_over_radius);
}

double BedStep(const BedSpec& bed) {
  const GrainSoil& soil = bed.soil;
  const ContactModel contacts = BedContacts(soil, FrictionOf(soil));
  const double weight = soil.density_kg_per_m3 * soil.gravity_m_per_s2 * bed.depth_m;
  return StepWithin(soil, contacts, bed.rayleigh_fraction, OverlapUnder(soil, contacts, weight));
}

double LoadedOverlap(const GrainSoil& soil, const WheelShape& wheel, double load_n) {
  return OverlapUnder(soil, RigContacts(soil, wheel),
                      MeanPressure(wheel, load_n, 0.2 * wheel.radius_m));
}

double ExperimentStep(const WheelTestSpec& spec) {
  const double overlap = LoadedOverlap(spec.soil, spec.wheel, spec.state.load_n);
  if (spec.rig.scene.largest_step) return LargestStep(spec.soil, spec.wheel, overlap);
  return StepWithin(spec.soil, spec.wheel, spec.rig.rayleigh_fraction, overlap);
}

}  // namespace grouser::dem
