// What an experiment may be.
#include "dem_offline/engine/experiment/validate.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "dem_offline/engine/experiment/bonded_grain.h"
#include "dem_offline/engine/experiment/follow.h"
#include "dem_offline/engine/experiment/freedoms.h"
#include "dem_offline/engine/experiment/ground.h"
#include "dem_offline/engine/experiment/joint_probes.h"
#include "dem_offline/engine/experiment/mixing.h"
#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/experiment/probes.h"
#include "dem_offline/engine/experiment/ruts.h"
#include "dem_offline/engine/experiment/shapes.h"
#include "dem_offline/engine/experiment/treads.h"
#include "dem_offline/engine/laws/material.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kLargest = 1e4;       // [m]
constexpr double kLargestGrain = 0.5;  // [m]
constexpr double kPlanarWidth = 8;     // [largest diameters] across a planar box
constexpr double kMostBins = 1e6;
constexpr double kMostSamples = 1e7;

std::string At(const char* list, std::size_t i) {
  return std::string(list) + "[" + std::to_string(i) + "]";
}

void CheckNotNegative(const std::string& field, double v) { CheckWithin(field, v, 0, 1e300); }

/// Names stand in names of files and columns of CSVs.
void CheckName(const std::string& at, const std::string& name) {
  constexpr std::size_t kLongest = 64;
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
  if (plain && !name.empty() && name.size() <= kLongest && name != kAny) return;
  throw SpecError(
      at + ".name", "'" + name + "'",
      "a name of 1 to " + std::to_string(kLongest) + " letters (a to z), digits, _ and -; not any");
}

void CheckNames(const std::vector<std::string>& names, const char* list) {
  std::set<std::string> seen;
  for (std::size_t i = 0; i < names.size(); ++i) {
    CheckName(At(list, i), names[i]);
    if (!seen.insert(names[i]).second) {
      throw SpecError(At(list, i) + ".name", "'" + names[i] + "' twice", "names that differ");
    }
  }
}

void CheckMaterials(const Experiment& e) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < e.materials.size(); ++i) {
    const Material& m = e.materials[i];
    names.push_back(m.name);
    CheckNotNegative(At("materials", i) + ".density_kg_per_m3", m.density_kg_per_m3);
    CheckNotNegative(At("materials", i) + ".youngs_modulus_pa", m.youngs_modulus_pa);
    CheckWithin(At("materials", i) + ".poisson_ratio", m.poisson_ratio, 0, 0.5);
  }
  CheckNames(names, "materials");
  if (e.materials.size() > kMostMaterials) {
    throw SpecError("materials", std::to_string(e.materials.size()),
                    "at most " + std::to_string(kMostMaterials));
  }
  for (std::size_t i = 0; i < e.interfaces.size(); ++i) {
    const PairProperties& f = e.interfaces[i];
    CheckWithin(At("interfaces", i) + ".restitution", f.restitution, 1e-3, 1);
    CheckWithin(At("interfaces", i) + ".friction", f.friction, 0, 10);
    CheckWithin(At("interfaces", i) + ".rolling_friction", f.rolling_friction, 0, 10);
  }
}

void CheckRegion(const std::string& field, const Region& r, const BoxSpec& box) {
  const double size[3] = {box.length_m, box.width_m, box.height_m};
  const char* ends[2] = {".low_m", ".high_m"};
  for (int k = 0; k < 3; ++k) {
    for (const int end : {0, 1}) {
      CheckWithin(field + ends[end], end ? r.high_m[k] : r.low_m[k], 0, size[k] * (1 + 1e-9));
    }
    if (!(r.high_m[k] > r.low_m[k])) {
      throw SpecError(field + ".high_m", Short(r.high_m[k]), "more than low_m, axis by axis");
    }
  }
  const int across = box.planar ? 2 : 1;
  CheckWithin(
      field + ".radius_m", r.radius_m, 0,
      0.5 * std::min(r.high_m[0] - r.low_m[0], r.high_m[across] - r.low_m[across]) * (1 + 1e-9));
  CheckWithin(field + ".inner_radius_m", r.inner_radius_m, 0,
              std::max(0.0, r.radius_m * (1 - 1e-6)));
}

void CheckBox(const Experiment& e) {
  const std::pair<const char*, double> sides[] = {{"box.length_m", e.box.length_m},
                                                  {"box.width_m", e.box.width_m},
                                                  {"box.height_m", e.box.height_m}};
  for (const auto& [field, side] : sides) {
    CheckPositive(field, side);
    CheckWithin(field, side, 0, kLargest);
  }
  MaterialNumber(e, e.box.material, "box.material");
  CheckNotNegative("box.disc_thickness_m", e.box.disc_thickness_m);
  if (e.box.disc_thickness_m > 0 && !e.box.planar) {
    throw SpecError("box.disc_thickness_m", "it without planar", "planar: on beside it");
  }
  if (e.box.planar && e.box.y != Side::kPeriodic) {
    throw SpecError("box.y", "a wall or open side with planar", "periodic");
  }
  const double least = (e.box.planar ? kPlanarWidth : kLeastSideGrains) * LargestDiameter(e);
  for (const auto& [field, side] : sides) {
    const bool x = field == sides[0].first, y = field == sides[1].first;
    const bool periodic = (x && e.box.x == Side::kPeriodic) || (y && e.box.y == Side::kPeriodic);
    if (periodic && side < least) {
      throw SpecError(
          field, Short(side) + " m",
          "at least " + Short(least) + " m, so that no grain meets two images of another");
    }
  }
}

void CheckSizes(const std::string& at, const Grains& g) {
  double sum = 0;
  for (std::size_t i = 0; i < g.sizes.size(); ++i) {
    const std::string field = at + ".sizes[" + std::to_string(i) + "]";
    CheckPositive(field + ".diameter_m", g.sizes[i].diameter_m);
    CheckWithin(field + ".diameter_m", g.sizes[i].diameter_m, 0, kLargestGrain);
    CheckPositive(field + ".mass_fraction", g.sizes[i].mass_fraction);
    sum += g.sizes[i].mass_fraction;
  }
  if (g.filling == Filling::kListed) {
    if (g.listed.empty()) throw SpecError(at + ".file", "no grain", "at least one");
    return;
  }
  if (g.sizes.empty()) throw SpecError(at + ".sizes", "none", "at least one size");
  if (!(std::abs(sum - 1) <= 1e-6)) {
    throw SpecError(at + ".sizes", "mass fractions that sum to " + Short(sum), "a sum of 1");
  }
}

}  // namespace

SpecError InGrains(const SpecError& error, const std::string& at) {
  for (const char* key : {".solid_fraction", ".preparation", ".top_layer"}) {
    const std::string field = std::string("soil.grains") + key;
    if (!error.field().starts_with(field)) continue;
    return SpecError(at + error.field().substr(std::string("soil.grains").size()), error.got(),
                     error.expected());
  }
  return SpecError(at, error.field() + ": " + error.got(), error.expected());
}

namespace {

void CheckBed(const Experiment& e, const std::string& at, const Grains& g,
              const WorkLimits& limits) {
  if (e.box.planar) {
    throw SpecError(at + ".kind", "bed in a planar box", "poured: not possible yet");
  }
  if (e.grains.size() > 1) {
    throw SpecError(at + ".kind", "bed beside other grains", "a bed alone, or other kinds");
  }
  if (e.box.x != Side::kPeriodic || e.box.y != Side::kPeriodic) {
    throw SpecError(at + ".kind", "bed in a box with walls or open sides",
                    "periodic sides: a bed between walls is poured and cut");
  }
  if (!e.preparation.empty()) {
    throw SpecError("preparation", "it with a bed, which is prepared by itself", "none");
  }
  if (!ContactsOf(e).All(LawsOf(e.laws))) {
    throw SpecError(at + ".kind", "bed with interfaces that have laws of their own",
                    "one law combination, or grains that are poured: not possible yet");
  }
  CheckPositive(at + ".solid_fraction", g.solid_fraction);
  CheckPositive(at + ".depth_m", g.depth_m);
  if (!(g.depth_m < e.box.height_m)) {
    throw SpecError(at + ".depth_m", Short(g.depth_m), "less than box.height_m");
  }
  try {
    ValidateBed(BedOf(e, g), limits);
  } catch (const SpecError& error) {
    throw InGrains(error, at);
  }
}

/// Sites that are asked for, and whether they fit below the top of the box.
void CheckSites(const Experiment& e, const std::string& at, const Grains& g) {
  CheckRegion(at + ".region", g.region, e.box);
  const bool lattice = g.filling == Filling::kLattice;
  if (g.pitch_m != 0) CheckWithin(at + ".pitch_m", g.pitch_m, LargestDiameter(e), kLargest);
  const Sites s = SitesOf(g);
  const double per_layer = s.nx >= 1 && s.ny >= 1 ? CountInLayer(s, g) : 0;
  if (!(per_layer >= 1)) {
    throw SpecError(at + ".region", "no room for a grain", "a region wider than one grain");
  }
  CheckWithin(at + ".count", static_cast<double>(g.count), lattice ? 0 : 1, kMostGrains);
  const double layers = std::ceil(static_cast<double>(g.count) / per_layer);
  const double room = g.filling == Filling::kPoured
                          ? std::floor((e.box.height_m - g.region.low_m[2]) / s.pitch_m)
                          : s.layers;
  if (g.filling == Filling::kRained) {
    if (s.layers < 1) throw SpecError(at + ".region", "no room for a layer", "a higher one");
    if (!(g.speed_m_per_s > 0) && !(e.gravity_m_per_s2 > 0)) {
      throw SpecError(at + ".speed_m_per_s", "none, without gravity", "a number > 0");
    }
  } else if (layers > room || (lattice && s.layers < 1)) {
    throw SpecError(at + ".count",
                    Short(static_cast<double>(g.count)) + " grains in " + Short(layers) +
                        " layers of " + Short(per_layer),
                    "at most " + Short(room) + " layers of " + Short(s.pitch_m) +
                        " m below the top of the box");
  }
  CheckNotNegative(at + ".speed_m_per_s", g.speed_m_per_s);
}

/// Grains that are put at random: their number.
void CheckScattered(const Experiment& e, const std::string& at, const Grains& g) {
  CheckRegion(at + ".region", g.region, e.box);
  const char* key = g.areal_fraction > 0 ? ".areal_fraction" : ".count";
  CheckWithin(at + ".areal_fraction", g.areal_fraction, 0, 1e3);
  CheckWithin(at + key, static_cast<double>(g.count), 1, kMostGrains);
}

/// Worlds with clumps take no grains in or out.
void CheckClump(const Experiment& e, const std::string& at, const Grains& g) {
  if (g.clump.empty()) return;
  const auto refuse = [&](const std::string& with) {
    throw SpecError(at + ".clump", "clumps with " + with, "other grains: not possible yet");
  };
  if (g.clump.size() > 1000) throw SpecError(at + ".clump", "too many", "at most 1000 spheres");
  if (e.box.planar) refuse("planar");
  if (e.box.x == Side::kOpen || e.box.y == Side::kOpen) refuse("open sides");
  for (const Grains& o : e.grains) {
    if (o.filling == Filling::kRained) refuse("rain");
  }
  for (const Preparation& p : e.preparation) {
    if (p.kind == Preparation::Kind::kCut) refuse("a cut");
  }
}

void CheckGrains(const Experiment& e, const WorkLimits& limits) {
  if (e.grains.empty()) throw SpecError("grains", "none", "at least one group");
  for (std::size_t i = 0; i < e.grains.size(); ++i) {
    const Grains& g = e.grains[i];
    const std::string at = At("grains", i);
    MaterialNumber(e, g.material, at + ".material");
    const Material& m = MaterialOf(e, g.material);
    if (!(m.density_kg_per_m3 > 0) || !(m.youngs_modulus_pa > 0)) {
      throw SpecError(at + ".material", "'" + m.name + "' without density or Young's modulus",
                      "a material with both");
    }
    CheckSizes(at, g);
    CheckClump(e, at, g);
    CheckBonding(e, at, g);
    if (g.filling == Filling::kRained && i > 0 && g.material != e.grains[0].material) {
      throw SpecError(at + ".material", "rain of a second material of grains",
                      "that of the first group: not possible yet");
    }
  }
  CheckBox(e);
  try {
    LawsOf(e.laws);
    ContactsOf(e);
  } catch (const SpecError&) {
    throw;
  } catch (const std::invalid_argument& error) {
    throw SpecError("laws", error.what(), "laws and settings that `grouser-dem laws` lists");
  }
  for (std::size_t i = 0; i < e.grains.size(); ++i) {
    const Grains& g = e.grains[i];
    if (g.filling == Filling::kBed) CheckBed(e, At("grains", i), g, limits);
    const bool sites = g.filling == Filling::kPoured || g.filling == Filling::kRained ||
                       g.filling == Filling::kLattice;
    if (sites) CheckSites(e, At("grains", i), g);
    if (g.filling == Filling::kScattered) CheckScattered(e, At("grains", i), g);
    if (g.filling == Filling::kPlaced) CheckPlaces(e, At("grains", i), g);
    const double size[3] = {e.box.length_m, e.box.width_m, e.box.height_m};
    for (std::size_t k = 0; k < g.listed.size(); ++k) {
      const GrainState& s = g.listed[k];
      const double at[3] = {s.x_m, s.y_m, s.z_m};
      bool in = s.radius_m > 0 && s.radius_m <= 0.5 * kLargestGrain;
      for (int a = 0; a < 3; ++a) in = in && at[a] >= 0 && at[a] <= size[a];
      if (!in) {
        throw SpecError(At("grains", i) + ".file",
                        "grain " + std::to_string(k) + " outside of the box or without a radius",
                        "grains in the box, radii up to 0.25 m");
      }
    }
  }
}

/// A solid fraction is measured over the whole box.
void CheckFillsBox(const Experiment& e, const std::string& field) {
  for (const Grains& g : e.grains) {
    const Region& r = g.region;
    const bool whole_y = e.box.planar || (r.low_m[1] <= 0 && r.high_m[1] >= e.box.width_m);
    const bool whole =
        r.low_m[0] <= 0 && r.high_m[0] >= e.box.length_m && whole_y && !(r.radius_m > 0);
    if (whole && e.box.x != Side::kOpen && e.box.y != Side::kOpen) continue;
    throw SpecError(field, "it with grains in a part of the box, or open sides",
                    "grains over the whole floor, between walls or periodic sides");
  }
}

/// Largest of the interfaces' [J/m^2]: the reach of contacts is made for it.
double LargestSurfaceEnergy(const Experiment& e) {
  double largest = 0;
  for (const PairProperties& f : e.interfaces) {
    largest = std::max(largest,
                       f.numbers.surface_energy_j_per_m2.value_or(e.laws.surface_energy_j_per_m2));
  }
  return largest;
}

void CheckPreparation(const Experiment& e) {
  if (e.gravity_m_per_s2 == 0 && !e.preparation.empty()) {
    throw SpecError("preparation", "it without gravity", "none, or gravity_m_per_s2 > 0");
  }
  for (std::size_t i = 0; i < e.preparation.size(); ++i) {
    const Preparation& p = e.preparation[i];
    const std::string at = At("preparation", i);
    CheckNotNegative(at + ".most_s", p.most_s);
    CheckPositive(at + ".rest", p.rest);
    if (p.friction >= 0) CheckWithin(at + ".friction", p.friction, 0, 10);
    if (p.rolling_friction >= 0) CheckWithin(at + ".rolling_friction", p.rolling_friction, 0, 10);
    if (p.surface_energy_j_per_m2 >= 0) {
      CheckWithin(at + ".surface_energy_j_per_m2", p.surface_energy_j_per_m2, 0,
                  LargestSurfaceEnergy(e));
    }
    if (p.solid_fraction != 0) {
      CheckWithin(at + ".solid_fraction", p.solid_fraction, 0.3, 0.85);
      if (p.friction >= 0) {
        throw SpecError(at + ".solid_fraction", "it beside friction", "one of them");
      }
      CheckFillsBox(e, at + ".solid_fraction");
    }
    if (p.kind == Preparation::Kind::kShake) {
      CheckPositive(at + ".frequency_hz", p.frequency_hz);
      CheckPositive(at + ".for_s", p.for_s);
      CheckPositive(at + ".amplitude_m", Norm(p.amplitude_m));
    }
    if (p.kind == Preparation::Kind::kTurn) CheckTurn(e, at, p);
    if (p.kind == Preparation::Kind::kCut) {
      CheckWithin(at + ".height_m", p.height_m, 2 * SmallestRadius(e), e.box.height_m);
    }
  }
}

void CheckEnds(const Experiment& e, const std::string& at, const BodySpec& body,
               const MotionStep& s) {
  const std::pair<const char*, double> ends[] = {{".for_s", s.for_s},
                                                 {".distance_m", s.distance_m},
                                                 {".angle_rad", s.angle_rad},
                                                 {".force_n", s.force_n}};
  for (const auto& [name, value] : ends) {
    if (!(value > 0)) throw SpecError(at + name, Short(value), "a number > 0");
  }
  CheckNotNegative(at + ".most_s", s.most_s);
  CheckNotNegative(at + ".ramp_s", s.ramp_s);
  if (!s.until_done.empty()) {
    const auto other = std::find_if(e.bodies.begin(), e.bodies.end(),
                                    [&](const BodySpec& b) { return b.name == s.until_done; });
    if (other == e.bodies.end() || s.until_done == body.name || other->motion.empty()) {
      throw SpecError(at + ".until_done", "'" + s.until_done + "'",
                      "the name of another body that moves");
    }
    for (const MotionStep& o : other->motion) {
      if (!o.until_done.empty() && !(o.most_s > 0)) {
        throw SpecError(at + ".until_done",
                        "'" + s.until_done + "', which itself waits for " + o.until_done,
                        "most_s at that step");
      }
    }
  }
  if (!std::isfinite(MostTime(e, body, s))) {
    throw SpecError(at, s.verb + " without an end",
                    "for_s, distance_m with a speed, angle_deg with a rate, or most_s");
  }
}

void CheckMotion(const Experiment& e, const std::string& at, const BodySpec& body) {
  for (std::size_t i = 0; i < body.motion.size(); ++i) {
    const MotionStep& s = body.motion[i];
    const std::string here = at + "." + At("motion", i);
    if (s.hold) {
      if (!std::isfinite(s.hold_force_n)) {
        throw SpecError(here + ".hold_force_n", Short(s.hold_force_n), "a finite number");
      }
      CheckNotNegative(here + ".mass_kg", s.hold_mass_kg);
      if (!(s.hold_mass_kg > 0) && !(s.hold_force_n > 0 && e.gravity_m_per_s2 > 0)) {
        throw SpecError(here + ".mass_kg", "none", "the mass of the free axis");
      }
    }
    if (Norm(s.amplitude_m) > 0) CheckPositive(here + ".frequency_hz", s.frequency_hz);
    CheckFreedoms(e, here, body, s);
    CheckEnds(e, here, body, s);
  }
}

/// A body begins where some of it is in the box, and where its frame can hold it.
void CheckPlace(const Experiment& e, const std::string& at, const BodySpec& b, const Body& built) {
  const double size[2] = {e.box.length_m, e.box.width_m};
  for (int k = 0; k < 2; ++k) {
    const double x = built.position_m[k], reach = built.shape.reach;
    if (x >= -reach && x <= size[k] + reach) continue;
    throw SpecError(at + ".position_m",
                    std::string(k == 0 ? "x" : "y") + " = " + Short(x) + " m, with a reach of " +
                        Short(reach) + " m: all of it outside of the box",
                    "some of it within 0 and " + Short(size[k]) + " m");
  }
  if (std::isnan(b.above_surface_m)) {
    CheckWithin(at + ".position_m", b.position_m[2], -0.5 * e.box.height_m, 1.5 * e.box.height_m);
    return;
  }
  const double lowest = b.above_surface_m + built.position_m[2] - LowestPoint(built);
  if (std::abs(lowest) < kMostHeight * e.box.height_m) return;
  throw SpecError(at + ".above_surface_m",
                  Short(b.above_surface_m) + ": its origin at z = " + Short(lowest) + " m or more",
                  "one that stays below " + Short(kMostHeight) + " heights of the box");
}

void CheckBodies(const Experiment& e) {
  std::vector<std::string> names;
  bool moves = e.duration_s > 0;
  for (const BodySpec& b : e.bodies) names.push_back(b.name);
  CheckNames(names, "bodies");
  for (std::size_t i = 0; i < e.bodies.size(); ++i) {
    const BodySpec& b = e.bodies[i];
    const std::string at = At("bodies", i);
    const int number = MaterialNumber(e, b.material, at + ".material");
    if (b.parts.empty()) throw SpecError(at + ".parts", "none", "at least one");
    CheckNotNegative(at + ".mass_kg", b.mass_kg);
    for (const double v : b.inertia_kg_m2) CheckNotNegative(at + ".inertia_kg_m2", v);
    if (b.inertia_kg_m2 != Vec3d{0, 0, 0} && !(b.mass_kg > 0)) {
      throw SpecError(at + ".inertia_kg_m2", "it without mass_kg", "both");
    }
    if (!std::isnan(b.above_surface_m) && b.while_preparing) {
      throw SpecError(at + ".above_surface_m", "it while preparing", "a height of its own");
    }
    CheckMotion(e, at, b);
    CheckPlace(
        e, at, b,
        BuildBody(b, MaterialOf(e, b.material), number, MovesFreely(b) || IsJointed(e, b.name), at)
            .body);
    moves = moves || !b.motion.empty();
  }
  if (!moves) throw SpecError("duration_s", "none", "a duration where no body moves");
}

void CheckProbes(const Experiment& e) {
  CheckPositive("output.sample_s", e.sample_s);
  std::vector<std::string> tables;
  for (std::size_t i = 0; i < e.probes.size(); ++i) {
    const Probe& p = e.probes[i];
    const std::string at = At("probes", i);
    const bool of_body = p.kind == Probe::Kind::kWrench || p.kind == Probe::Kind::kPose ||
                         p.kind == Probe::Kind::kVelocity || p.kind == Probe::Kind::kTreads ||
                         p.kind == Probe::Kind::kTouching || p.kind == Probe::Kind::kRuts;
    if (of_body && std::none_of(e.bodies.begin(), e.bodies.end(),
                                [&](const BodySpec& b) { return b.name == p.body; })) {
      throw SpecError(at + ".body", "'" + p.body + "'", "the name of a body");
    }
    if (p.kind == Probe::Kind::kTreads) CheckTreads(e, at, p);
    BoxSpec seen = e.box;
    if (!e.box.follow.body.empty()) seen.length_m = e.box.follow.length_m;
    if (p.kind == Probe::Kind::kMixing) {
      CheckRegion(at + ".region", p.region, seen);
      CheckMixing(at, p);
    }
    if (p.kind == Probe::Kind::kJoint || p.kind == Probe::Kind::kSpring) CheckJointProbe(e, at, p);
    if (p.kind == Probe::Kind::kBins && e.box.planar && (p.n[1] != 1 || p.region.radius_m > 0)) {
      throw SpecError(at + ".n", "bins along y or round in a planar box", "[nx, 1, nz], or rings");
    }
    CheckBondProbe(e, at, p);
    if (!HasTable(p)) continue;
    tables.push_back(p.name);
    CheckName(at, p.name);
    if (p.name == "series" || std::count(tables.begin(), tables.end(), p.name) > 1) {
      throw SpecError(at + ".name", "'" + p.name + "'", "a name of its own, and not series");
    }
    CheckNotNegative(at + ".every_s", p.every_s);
    if (p.every_s > 0) CheckWithin(at + ".every_s", p.every_s, e.sample_s, 1e300);
    if (p.kind == Probe::Kind::kGrains) continue;
    CheckRegion(at + ".region", p.region, seen);
    if (p.kind == Probe::Kind::kRings) {
      CheckPositive(at + ".region.radius_m", p.region.radius_m);
      CheckWithin(at + ".rings", p.rings, 1, kMostBins);
      CheckNotNegative(at + ".from_s", p.from_s);
      continue;
    }
    CheckWithin(at + ".n", 1.0 * p.n[0] * p.n[1] * p.n[2], 1, kMostBins);
    if (p.kind == Probe::Kind::kRuts) CheckRuts(e, at, p);
  }
}

}  // namespace

void Validate(const Experiment& e, const WorkLimits& limits) {
  CheckWithin("gravity_m_per_s2", e.gravity_m_per_s2, 0, 1e6);
  CheckNotNegative("duration_s", e.duration_s);
  CheckWithin("numerics.rayleigh_fraction", e.rayleigh_fraction, 1e-3, 0.4);
  CheckWithin("numerics.program_step", e.program_step, 0.01, 1);
  CheckWithin("numerics.overlap", e.overlap, 1e-6, 0.5);
  CheckMaterials(e);
  CheckGrains(e, limits);
  CheckPreparation(e);
  CheckBodies(e);
  CheckJoints(e);
  CheckFollow(e);
  CheckProbes(e);
  CheckFrames(e);
  CheckCheckpoints(e);
}

void ValidateSpeeds(const Experiment& e, double dt_s) {
  const double most = 0.1 * SmallestRadius(e) / dt_s;
  const auto check = [&](const std::string& field, double speed) {
    if (speed <= most) return;
    throw SpecError(field, Short(speed) + " m/s (" + Short(speed * dt_s) + " m in a time step)",
                    "at most " + Short(most) + " m/s, a tenth of the smallest radius in a step");
  };
  for (std::size_t i = 0; i < e.grains.size(); ++i) {
    check(At("grains", i) + ".speed_m_per_s", e.grains[i].speed_m_per_s);
  }
  for (std::size_t i = 0; i < e.preparation.size(); ++i) {
    const Preparation& p = e.preparation[i];
    check(At("preparation", i) + ".frequency_hz", 2 * M_PI * p.frequency_hz * Norm(p.amplitude_m));
  }
  for (std::size_t i = 0; i < e.joints.size(); ++i) {
    const Joint& j = e.joints[i];
    const auto child = std::find_if(e.bodies.begin(), e.bodies.end(),
                                    [&](const BodySpec& b) { return b.name == j.child; });
    const bool slides = j.kind == Joint::Kind::kTranslational;
    const double arm = slides ? 1 : ShapeOf(child->parts, At("joints", i)).reach;
    for (const ProgrammePart& part : j.drive) {
      check(At("joints", i) + ".drive", std::abs(part.value) * arm);
    }
  }
  double longest = 0;
  for (std::size_t i = 0; i < e.bodies.size(); ++i) {
    const BodySpec& b = e.bodies[i];
    const bool turns = std::any_of(b.motion.begin(), b.motion.end(),
                                   [](const MotionStep& s) { return Norm(s.spin_rad_per_s) > 0; });
    const double reach = turns ? ShapeOf(b.parts, At("bodies", i)).reach : 0;
    for (std::size_t k = 0; k < b.motion.size(); ++k) {
      const MotionStep& s = b.motion[k];
      const double spin = Norm(s.spin_rad_per_s);
      check(At("bodies", i) + "." + At("motion", k),
            Norm(s.velocity_m_per_s) + (spin > 0 ? spin * reach : 0) +
                2 * M_PI * s.frequency_hz * Norm(s.amplitude_m));
      longest = std::max(longest, MostTime(e, b, s));
    }
  }
  if (std::max(longest, e.duration_s) / e.sample_s > kMostSamples) {
    throw SpecError("output.sample_s", Short(e.sample_s), "at most 1e7 samples");
  }
}

}  // namespace grouser::dem::experiment
