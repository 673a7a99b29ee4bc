#include "dem_offline/engine/experiment/bonded_grain.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dem_offline/engine/experiment/plan.h"

namespace grouser::dem::experiment {
namespace {

constexpr int kMostPushes = 20000;
// Of the spheres in a grain; random packings end at 0.64, less near a wall: 0.6 (1 - 0.8 d/D).
constexpr double kMostSolid = 0.6, kWallShare = 0.8;
constexpr double kMostFragments = 20000;
constexpr double kMostBondsEach = 6;   // a dense packing has six pairs a sphere that touch
constexpr double kFarthestBond = 2.5;  // [fragments' diameters]

Vec3d RandomIn(double radius, Random& random) {
  for (;;) {
    const Vec3d p = {random.Between(-1, 1), random.Between(-1, 1), random.Between(-1, 1)};
    if (DotD(p, p) <= 1) return Scale(radius, p);
  }
}

using Pairs = std::vector<std::array<std::int32_t, 2>>;

Pairs PairsWithin(const std::vector<Vec3d>& at, double distance) {
  Pairs out;
  for (std::size_t a = 0; a < at.size(); ++a) {
    for (std::size_t b = a + 1; b < at.size(); ++b) {
      const Vec3d d = Sub(at[b], at[a]);
      if (DotD(d, d) > distance * distance) continue;
      out.push_back({static_cast<std::int32_t>(a), static_cast<std::int32_t>(b)});
    }
  }
  return out;
}

/// Pushes the pairs apart once; the least distance there was before.
double Push(std::vector<Vec3d>& at, const Pairs& pairs, double distance, double room) {
  double least = kNever;
  for (const auto& [a, b] : pairs) {
    const Vec3d apart = Sub(at[b], at[a]);
    const double now = Norm(apart);
    least = std::min(least, now);
    if (now >= distance) continue;
    const Vec3d way =
        now > 0 ? Scale(0.5 * (distance - now) / now, apart) : Vec3d{0.5 * distance, 0, 0};
    at[a] = Sub(at[a], way);
    at[b] = Add(at[b], way);
  }
  for (Vec3d& p : at) {
    const double out = Norm(p);
    if (out > room) p = Scale(room / out, p);
  }
  return least;
}

std::vector<Vec3d> Pack(int count, double diameter, double room, Random& random,
                        const std::string& field) {
  constexpr double kSpare = 1e-3, kNear = 1.5;  // [diameters]
  std::vector<Vec3d> at(count);
  for (Vec3d& p : at) p = RandomIn(room, random);
  double least = 0;
  std::vector<Vec3d> listed_at;
  Pairs pairs;
  for (int k = 0; k < kMostPushes; ++k) {
    double gone = listed_at.empty() ? kNever : 0;
    for (std::size_t i = 0; i < listed_at.size(); ++i) {
      gone = std::max(gone, Norm(Sub(at[i], listed_at[i])));
    }
    if (gone > 0.5 * (kNear - 1 - kSpare) * diameter) {
      pairs = PairsWithin(at, kNear * diameter);
      listed_at = at;
    }
    std::vector<Vec3d> before = at;
    least = Push(at, pairs, (1 + kSpare) * diameter, room);
    if (least >= diameter) return before;
  }
  throw SpecError(field + ".fragments",
                  std::to_string(count) + " that overlap by " + Short(1 - least / diameter) +
                      " of their diameter after every attempt",
                  "fewer, or smaller ones");
}

}  // namespace

BondedGrain MakeBondedGrain(const Grains& g, Random& random, const std::string& field) {
  const Bonding& b = g.bonds;
  const double room = 0.5 * (g.sizes[0].diameter_m - b.fragment_m);
  BondedGrain out;
  out.centres_m = Pack(b.fragments, b.fragment_m, room, random, field);
  Pairs pairs = PairsWithin(out.centres_m, kFarthestBond * b.fragment_m);
  if (static_cast<std::int64_t>(pairs.size()) < b.count) {
    throw SpecError(field + ".count", std::to_string(b.count),
                    "at most " + std::to_string(pairs.size()) + ", the pairs nearer than " +
                        Short(kFarthestBond) + " fragments");
  }
  const auto length = [&](const std::array<std::int32_t, 2>& p) {
    return Norm(Sub(out.centres_m[p[1]], out.centres_m[p[0]]));
  };
  std::stable_sort(pairs.begin(), pairs.end(),
                   [&](const auto& p, const auto& q) { return length(p) < length(q); });
  pairs.resize(b.count);
  if (!pairs.empty()) out.reach_m = length(pairs.back());
  std::sort(pairs.begin(), pairs.end());
  out.bonds = std::move(pairs);
  return out;
}

BondLaw BondLawOf(const Bonding& b, double reach_m) {
  BondLaw law = b.law;
  law.largest_length_m = b.largest_distance * reach_m;
  return law;
}

double BondStep(const Grains& g, double density) {
  if (g.bonds.fragments == 0) return kNever;
  const double r = 0.5 * g.bonds.fragment_m, m = density * 4.0 / 3 * M_PI * r * r * r;
  return BondStepOf(g.bonds.law, g.bonds.disk_scale * r, kFarthestBond * g.bonds.fragment_m,
                    0.5 * m, 0.5 * 0.4 * m * r * r);
}

bool HasBonds(const Experiment& e) {
  return std::any_of(e.grains.begin(), e.grains.end(),
                     [](const Grains& g) { return g.bonds.fragments > 0; });
}

namespace {

void CheckLaw(const std::string& at, const Bonding& b) {
  CheckPositive(at + ".normal_stiffness_n_per_m3", b.law.normal_stiffness_n_per_m3);
  CheckPositive(at + ".shear_stiffness_n_per_m3", b.law.shear_stiffness_n_per_m3);
  CheckPositive(at + ".strength_pa", b.law.tensile_strength_pa);
  CheckPositive(at + ".strength_ratio", b.law.shear_strength_pa);
  CheckPositive(at + ".largest_stretch", b.law.largest_stretch);
  CheckWithin(at + ".largest_distance", b.largest_distance, 1, 1e300);
  CheckWithin(at + ".damping_ratio", b.law.damping_ratio, 0, 1);
  CheckWithin(at + ".disk_scale", b.disk_scale, 1e-3, 10);
}

}  // namespace

void CheckBonding(const Experiment& e, const std::string& group, const Grains& g) {
  const Bonding& b = g.bonds;
  const std::string at = group + ".bonds";
  if (b.fragments == 0) return;
  const auto refuse = [&](const std::string& with) {
    throw SpecError(at, "bonded grains with " + with, "it without: not possible yet");
  };
  if (!g.clump.empty()) refuse("clump");
  if (g.sizes.size() > 1) refuse("several sizes in one group (use groups of one size)");
  if (e.box.planar) refuse("planar");
  if (e.box.x == Side::kOpen || e.box.y == Side::kOpen) refuse("open sides");
  for (const Grains& o : e.grains) {
    if (o.filling == Filling::kRained) refuse("rain");
  }
  for (const Preparation& p : e.preparation) {
    if (p.kind == Preparation::Kind::kCut) refuse("a cut");
  }
  const double d = g.sizes[0].diameter_m;
  CheckPositive(at + ".fragment_m", b.fragment_m);
  if (!(b.fragment_m < d)) {
    throw SpecError(at + ".fragment_m", Short(b.fragment_m), "less than diameter_m, " + Short(d));
  }
  CheckWithin(at + ".fragments", b.fragments, 2, kMostFragments);
  const double solid = b.fragments * std::pow(b.fragment_m / d, 3);
  const double most = kMostSolid * (1 - kWallShare * b.fragment_m / d);
  if (!(solid <= most)) {
    throw SpecError(at + ".fragments",
                    std::to_string(b.fragments) + ", " + Short(solid) + " of the grain's volume",
                    "at most " + Short(std::floor(most / solid * b.fragments)));
  }
  CheckWithin(at + ".count", static_cast<double>(b.count), 1,
              std::min(kMostBondsEach, 0.5 * (b.fragments - 1)) * b.fragments);
  CheckLaw(at, b);
}

void CheckPlaces(const Experiment& e, const std::string& at, const Grains& g) {
  if (g.places_m.empty()) throw SpecError(at + ".places", "none", "at least one place or a circle");
  const double d = LargestOf(g), size[3] = {e.box.length_m, e.box.width_m, e.box.height_m};
  for (std::size_t k = 0; k < g.places_m.size(); ++k) {
    const std::string place = at + ".places[" + std::to_string(k) + "].at_m";
    for (int a = 0; a < 3; ++a) {
      CheckWithin(place, g.places_m[k][a], 0.5 * d * (1 - 1e-9), size[a] - 0.5 * d * (1 - 1e-9));
    }
    for (std::size_t o = 0; o < k; ++o) {
      const double apart = Norm(Sub(g.places_m[k], g.places_m[o]));
      if (apart >= d * (1 - 1e-9)) continue;
      throw SpecError(place, Short(apart) + " m from place " + std::to_string(o),
                      "at least a grain's diameter, " + Short(d) + " m");
    }
  }
}

void CheckBondProbe(const Experiment& e, const std::string& at, const Probe& p) {
  const bool bonds = p.kind == Probe::Kind::kBonds || p.kind == Probe::Kind::kBondForces;
  if (bonds && !HasBonds(e)) {
    throw SpecError(at + ".kind", "bonds without bonded grains", "grains with bonds, or none");
  }
}

}  // namespace grouser::dem::experiment
