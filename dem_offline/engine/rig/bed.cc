// What a bed may be, and what it takes to settle it.
#include "dem_offline/engine/rig/bed.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/preparation.h"

namespace grouser::dem {
namespace {

constexpr double kLargestGrain = 0.5;  // [m]: beyond it somebody gave millimetres
constexpr double kLongestStep = 0.05;  // of sqrt(d/g): falling grains are resolved
constexpr double kPitch = 1.12;        // of the lattice, over the largest diameter
constexpr double kMoreSolid = 0.02;    // solid fraction poured beyond the target
constexpr double kMoreDepth = 1.5;     // [largest diameters] poured beyond the cut
// Between the loosest that cohesive grains stand in and the densest of wide gradings;
// dry spheres of about one size settle to 0.5 to 0.64.
constexpr double kLoosest = 0.3, kDensest = 0.85;

void CheckSizes(const GrainSoil& s) {
  if (s.sizes.empty()) throw SpecError("soil.grains.sizes", "none", "at least one size");
  double sum = 0;
  for (std::size_t i = 0; i < s.sizes.size(); ++i) {
    const std::string at = "soil.grains.sizes[" + std::to_string(i) + "]";
    CheckPositive(at + ".diameter_m", s.sizes[i].diameter_m);
    if (s.sizes[i].diameter_m > kLargestGrain) {
      throw SpecError(at + ".diameter_m", Short(s.sizes[i].diameter_m) + " m",
                      "metres, at most " + Short(kLargestGrain));
    }
    CheckPositive(at + ".mass_fraction", s.sizes[i].mass_fraction);
    sum += s.sizes[i].mass_fraction;
  }
  if (!(std::abs(sum - 1) <= 1e-6)) {
    throw SpecError("soil.grains.sizes", "mass fractions that sum to " + Short(sum), "a sum of 1");
  }
}

/// Numbers of the laws, of the grains or of one interface.
void CheckNumbers(const std::string& at, const ContactChoice& laws, const InterfaceChoice& here) {
  CheckWithin(at + ".rolling_damping", here.rolling_damping.value_or(0), 0, 10);
  const double energy = here.surface_energy_j_per_m2.value_or(0);
  CheckWithin(at + ".surface_energy_j_per_m2", energy, 0, 1e3);
  if (energy != 0 && laws.cohesion != "jkr" && laws.cohesion != "jkr_added") {
    throw SpecError(at + ".surface_energy_j_per_m2", Short(energy),
                    "0 unless cohesion is jkr or jkr_added");
  }
  for (const NamedSetting& n : here.settings) {
    const std::string field = at + "." + n.law + "." + n.name;
    if (!std::isfinite(n.value)) throw SpecError(field, Short(n.value), "a finite number");
    const bool chosen = n.law == laws.normal || n.law == laws.tangential || n.law == laws.rolling ||
                        n.law == laws.cohesion;
    if (!chosen) throw SpecError(field, Short(n.value), "settings of the chosen laws alone");
  }
}

void CheckContact(const GrainSoil& s) {
  const ContactChoice& c = s.contact;
  const std::string at = "soil.grains.contact";
  CheckNumbers(at, c, {c.rolling_damping, c.surface_energy_j_per_m2, c.settings});
  for (const auto& [name, here] : {std::pair{".wheel", &c.wheel}, std::pair{".floor", &c.floor}}) {
    CheckNumbers(at + name, c, *here);
    if (here->rolling_damping && c.rolling != "epsd") {
      throw SpecError(at + name + ".rolling_damping", Short(*here->rolling_damping),
                      "none unless rolling is epsd");
    }
  }
  try {
    LawsOf(c);
  } catch (const std::invalid_argument& error) {
    throw SpecError(at, error.what(),
                    "laws that may stand together (`grouser-dem laws` lists them)");
  }
  try {
    BedContacts(s, FrictionOf(s));
  } catch (const SpecError&) {
    throw;
  } catch (const std::invalid_argument& error) {
    throw SpecError(at, error.what(),
                    "settings that the laws accept (`grouser-dem laws` lists them)");
  }
}

void CheckPreparation(const std::string& at, const BedPreparation& p) {
  CheckWithin(at + ".friction", p.friction.value_or(0), 0, 10);
  CheckWithin(at + ".rolling_friction", p.rolling_friction.value_or(0), 0, 10);
}

void CheckSoil(const GrainSoil& s) {
  CheckPositive("soil.grains.grain_density_kg_per_m3", s.density_kg_per_m3);
  CheckPositive("soil.grains.youngs_modulus_pa", s.youngs_modulus_pa);
  CheckWithin("soil.grains.poisson_ratio", s.poisson_ratio, 0, 0.5);
  CheckWithin("soil.grains.restitution", s.restitution, 1e-3, 1);
  CheckWithin("soil.grains.friction", s.friction, 0, 10);
  CheckWithin("soil.grains.rolling_friction", s.rolling_friction, 0, 10);
  CheckWithin("soil.grains.solid_fraction", s.solid_fraction, kLoosest, kDensest);
  CheckPositive("soil.gravity_m_per_s2", s.gravity_m_per_s2);
  CheckPreparation("soil.grains.preparation", s.preparation);
  CheckPreparation("soil.grains.top_layer.preparation", s.top.preparation);
  CheckSizes(s);
  CheckContact(s);
}

void CheckSide(const char* field, double side_m, double least_grains, double diameter_m) {
  CheckPositive(field, side_m);
  if (side_m < least_grains * diameter_m) {
    throw SpecError(field, Short(side_m) + " m",
                    "at least " + Short(least_grains * diameter_m) + " m, " + Short(least_grains) +
                        " of the largest grains of " + Short(diameter_m) + " m");
  }
}

/// Both layers are thick enough to have a solid fraction without the grains at their ends.
void CheckTop(const BedSpec& bed, double diameter_m) {
  const TopLayer& top = bed.soil.top;
  if (top.thickness_m == 0) return;
  const std::string at = "soil.grains.top_layer";
  CheckSide((at + ".thickness_m").c_str(), top.thickness_m, kLeastTopGrains, diameter_m);
  CheckWithin(at + ".solid_fraction", top.solid_fraction, kLoosest, kDensest);
  const double most = bed.depth_m - kLeastDepthGrains * diameter_m;
  if (top.thickness_m <= most) return;
  throw SpecError(at + ".thickness_m", Short(top.thickness_m) + " m",
                  "at most " + Short(most) + " m: " + Short(kLeastDepthGrains) +
                      " of the largest grains lie under it");
}

void CheckStep(const BedSpec& bed) {
  CheckWithin("rig.rayleigh_fraction", bed.rayleigh_fraction, 1e-3, 0.4);
  const double dt = BedStep(bed), most = kLongestStep * GravityTime(bed.soil);
  if (dt <= most) return;
  throw SpecError("soil.grains.youngs_modulus_pa",
                  Short(bed.soil.youngs_modulus_pa) + " (time step " + Short(dt) + " s)",
                  "grains so stiff that the step is at most " + Short(most) + " s, " +
                      Short(kLongestStep) + " sqrt(d/g)");
}

}  // namespace

std::array<LooseLattice, 2> LatticesOf(const BedSpec& bed) {
  const double largest = LargestDiameter(bed.soil);
  const TopLayer& top = bed.soil.top;
  const auto lattice = [&](double solid_fraction, double depth_m) {
    LooseLattice l;
    l.pitch_m = kPitch * largest;
    l.nx = std::floor(bed.length_m / l.pitch_m);
    l.ny = std::floor(bed.width_m / l.pitch_m);
    l.solid_m3 = (solid_fraction + kMoreSolid) * bed.length_m * bed.width_m *
                 (depth_m + kMoreDepth * largest);
    l.layers = std::ceil(l.solid_m3 / (l.nx * l.ny * MeanGrainVolume(bed.soil)));
    return l;
  };
  return {lattice(bed.soil.solid_fraction, bed.depth_m - top.thickness_m),
          top.thickness_m > 0 ? lattice(top.solid_fraction, top.thickness_m) : LooseLattice{}};
}

Work WorkOf(const BedSpec& bed) {
  Work work;
  for (const LooseLattice& l : LatticesOf(bed)) work.grains += l.nx * l.ny * l.layers;
  work.steps = LongestPreparation(bed) / BedStep(bed);
  work.bytes = kBytesPerGrain * work.grains;
  return work;
}

void ValidateBed(const BedSpec& bed, const WorkLimits& limits) {
  CheckSoil(bed.soil);
  const double largest = LargestDiameter(bed.soil);
  CheckSide("rig.bed_length_m", bed.length_m, kLeastSideGrains, largest);
  CheckSide("rig.bed_width_m", bed.width_m, kLeastSideGrains, largest);
  CheckSide("rig.bed_depth_m", bed.depth_m, kLeastDepthGrains, largest);
  CheckTop(bed, largest);
  CheckStep(bed);
  CheckWork("rig.bed_length_m, bed_width_m, bed_depth_m", WorkOf(bed), limits);
  const auto lattices = LatticesOf(bed);
  const bool top = lattices[1].layers > 0;
  const LooseLattice& l = lattices[top];
  const double height = (l.layers + 1) * l.pitch_m - (top ? bed.soil.top.thickness_m : bed.depth_m),
               most = 0.5 * TileZSpan(bed.depth_m);
  if (height > most) {
    throw SpecError("soil.grains.sizes",
                    "so many small grains that they start " + Short(height) + " m above the bed",
                    "sizes nearer to each other, at most " + Short(most) + " m");
  }
}

}  // namespace grouser::dem
