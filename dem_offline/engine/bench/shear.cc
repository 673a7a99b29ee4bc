#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dem_offline/engine/bench/bed.h"

namespace grouser::dem::bench {
namespace {

constexpr double kPlate = 1.5;          // [diameters] of grains glued at either end
constexpr double kStrain = 1.0;         // until the shear counts as steady
constexpr double kServo = 0.02;         // [m/s] of the plate at twice or no stress
constexpr double kFastestPlate = 0.05;  // [m/s]

/// The upper plate's height follows the stress that it feels.
class Plates {
 public:
  Plates(const Bed& bed, World* world) : bed_(bed), world_(*world) {
    for (std::size_t i = 0; i < bed.grains.size(); ++i) {
      const GrainState& g = bed.grains[i];
      if (g.glued && g.v_x > 0) upper_.push_back(static_cast<std::int32_t>(i));
    }
  }
  double Stress() const {
    double force = 0;
    for (const std::int32_t id : upper_) force += world_.LoadOf(id).fz;
    return force / (bed_.length_m * bed_.width_m);
  }
  void Climb(double speed) {
    for (const std::int32_t id : upper_) {
      world_.SetVelocity(id, {bed_.grains[id].v_x, 0, speed}, {0, 0, 0});
    }
    speed_ = speed;
  }
  void Step() {
    const StepFault fault = world_.Step();
    if (fault != StepFault::kNone)
      throw std::runtime_error(std::string("shear: ") + Explain(fault));
    climbed_ += speed_ * bed_.dt_s;
  }
  double climbed() const { return climbed_; }

 private:
  const Bed& bed_;
  World& world_;
  std::vector<std::int32_t> upper_;
  double speed_ = 0, climbed_ = 0;
};

void Glue(double lowest, double highest, Bed* bed) {
  const double plate = kPlate * bed->source.mean_diameter_m;
  const double half = 0.5 * bed->shear_rate_per_s * bed->height_m;
  for (GrainState& g : bed->grains) {
    const bool low = g.z_m<lowest + plate, high = g.z_m> highest - plate;
    g.glued = low || high;
    // The flow it will settle to, to begin with.
    const double at = (g.z_m - lowest - plate) / bed->height_m;
    g.v_x = low ? -half : high ? half : half * (2 * at - 1);
  }
}

/// The surface of a poured bed: 99 % of the centres are below.
double HighSide(const Bed& bed) {
  std::vector<double> z;
  for (const GrainState& g : bed.grains) z.push_back(g.z_m);
  std::nth_element(z.begin(), z.begin() + static_cast<std::ptrdiff_t>(0.99 * z.size()), z.end());
  return z[static_cast<std::size_t>(0.99 * z.size())];
}

}  // namespace

Bed MakeShearBed(const BedSource& source, double inertial_number, double stress_pa) {
  Bed bed = MakeBed(source);
  bed.kind = "shear";
  const double d = source.mean_diameter_m;
  bed.shear_rate_per_s = inertial_number / d * std::sqrt(stress_pa / source.density_kg_per_m3);
  const double highest = HighSide(bed);
  bed.height_m = highest - 2 * kPlate * d;
  Glue(0, highest, &bed);
  World world(BenchConfig(bed, 1), BenchContents(bed));
  Plates plates(bed, &world);
  const auto steps = std::llround(kStrain / (bed.shear_rate_per_s * bed.dt_s));
  double mean = 0, smooth = stress_pa;
  std::int64_t counted = 0;
  for (std::int64_t s = 0; s < 3 * steps; ++s) {
    smooth += 0.01 * (plates.Stress() - smooth);
    plates.Climb(std::clamp(kServo * (smooth / stress_pa - 1), -kFastestPlate, kFastestPlate));
    plates.Step();
    if (s < steps / 2) continue;
    mean += (plates.climbed() - mean) / static_cast<double>(++counted);
    // At the mean height of steady shear under this stress: from here on it stays.
    if (s >= steps && std::abs(plates.climbed() - mean) < 1e-4 * d) break;
  }
  plates.Climb(0);
  for (std::int64_t s = 0; s < steps / 10; ++s) plates.Step();
  bed.height_m += plates.climbed();
  for (std::int64_t i = 0; i < world.count(); ++i) {
    bed.grains[world.grains()[i].id] = world.State(i);
  }
  SortInSpace(bed);
  return bed;
}

}  // namespace grouser::dem::bench
