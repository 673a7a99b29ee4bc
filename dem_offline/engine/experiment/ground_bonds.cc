// Bonded grains come into the box.
#include "dem_offline/engine/experiment/bonded_grain.h"
#include "dem_offline/engine/experiment/ground.h"

namespace grouser::dem::experiment {

/// A sphere, a clump or a bonded grain.
void Ground::AddGrain(const Grains& g, const GrainState& at, Contents* out) {
  if (g.bonds.fragments > 0) return AddBonded(g, at, out);
  if (!g.clump.empty()) return AddClump(g, at, out);
  out->grains.push_back(at);
}

/// Fragments and bonds in place of a grain, each one packed anew.
void Ground::AddBonded(const Grains& g, const GrainState& at, Contents* out) {
  const std::string field = "grains[" + std::to_string(&g - e_.grains.data()) + "].bonds";
  const BondedGrain made = MakeBondedGrain(g, random_, field);
  const auto first = static_cast<std::int32_t>(out->grains.size());
  GrainState s = at;
  s.radius_m = 0.5 * g.bonds.fragment_m;
  for (const Vec3d& centre : made.centres_m) {
    s.x_m = at.x_m + centre[0];
    s.y_m = at.y_m + centre[1];
    s.z_m = at.z_m + centre[2];
    out->grains.push_back(s);
  }
  const double disk = g.bonds.disk_scale * s.radius_m;
  const auto law = static_cast<int>(out->bond_laws.size());
  for (const auto& [a, b] : made.bonds) out->bonds.push_back({first + a, first + b, disk, law});
  out->bond_laws.push_back(BondLawOf(g.bonds, made.reach_m));
  bonded_grain_of_id_.resize(first, -1);
  bonded_grain_of_id_.resize(out->grains.size(), law);  // each grain has a law of its own
}

}  // namespace grouser::dem::experiment
