#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "dem_offline/engine/bodies/body.h"
#include "dem_offline/engine/bodies/clump.h"
#include "dem_offline/engine/contact/bond.h"
#include "dem_offline/engine/core/energy_sums.h"
#include "dem_offline/engine/core/frame.h"
#include "dem_offline/engine/laws/contact_model.h"
#include "dem_offline/engine/world/stepper.h"

// Configuration, contents and reports of a World, and exchanges of its grains.

namespace grouser::dem {

struct WorldConfig {
  Frame frame;                 ///< x, y periodic; see there
  Vec3d origin_m = {0, 0, 0};  ///< of the frame, in the user's coordinates
  Vec3d gravity_m_per_s2 = {0, 0, -9.81};
  double dt_s = 1e-4;
  double skin_m = 0;  ///< of the Verlet lists; 0: 0.2 largest radius
  ContactModel contacts;
  double inertia_factor = 0.4;  ///< I/(m r^2): 0.4 spheres, 0.5 discs
  bool planar = false;          ///< no motion along y, no spin but about y
  bool energy = false;          ///< integrate the energy channels
  int threads = 1;              ///< same bits for any number
  /// Refuse steps above World::CriticalStep at `guard_overlap` of the radius. 0: no guard.
  double guard_overlap = 0.0;
  std::int64_t first_pairs = 0;  ///< capacity of the lists to begin with; 0: ample
  /// Every so many steps grains are put in the order of space again, as World::Sort
  /// does: worth it where soil mixes. 0: never.
  std::int64_t sort_steps = 0;
  /// Makes the steps of Step and Run; null: these cores do.
  std::shared_ptr<Stepper> stepper;
};

/// One grain, as somebody outside sees it (SI, user's coordinates).
struct GrainState {
  double x_m, y_m, z_m, radius_m, density_kg_per_m3;
  double v_x = 0, v_y = 0, v_z = 0, w_x = 0, w_y = 0, w_z = 0;
  int material = 0;
  bool glued = false;  ///< keeps its velocity (0: fixed in space) whatever pushes
  double mass_kg = 0;  ///< 0: from the density of a sphere (discs: set it)
};

/// All that a world starts with. Ids: grains in order, then clump members.
struct Contents {
  std::vector<GrainState> grains;
  std::vector<ClumpTemplate> templates;
  std::vector<ClumpState> clumps;
  std::vector<BondLaw> bond_laws;
  std::vector<BondState> bonds;
  std::vector<Body> bodies;
};

/// One contact of a body, for whoever records stresses (world axes).
struct BodyContact {
  int body;
  Vec3f point;   ///< relative to the origin [m]
  Vec3f normal;  ///< unit, from the body into the grain
  Vec3f force;   ///< on the body [N]
  std::int32_t part;
  bool rim;
  std::int32_t grain;  ///< by place in memory
  float lever_m;       ///< from the grain's centre to the point
};

/// -sum over contacts of force (x) arm of one grain [N m], symmetric part: xx, yy, zz, xy, xz, yz.
using ContactMoment = std::array<double, 6>;

/// What went wrong in a step; the world stops there.
enum class StepFault : int { kNone, kNonFinite, kTooFast, kTunnelled, kOverlap };
const char* Explain(StepFault fault);

/// Where the energy is [J]. Total = kinetic + potential + stored + dissipated
/// + frozen - body_work is constant but for the integrator's error.
struct EnergyBalance : EnergySums {
  double kinetic = 0, potential = 0, bonds = 0;
  double body_work = 0;  ///< done by moving bodies on the grains
  double frozen = 0;     ///< taken out by Freeze and Exchange (kinetic, potential, stored)
  double Dissipated() const {
    return normal_damping + tangent_damping + slip + rolling + plastic + cohesion + bonds;
  }
  double Total() const { return kinetic + potential + stored + Dissipated() + frozen - body_work; }
};

/// Wall time by phase [s], summed over the steps since SetTiming(true).
struct Phases {
  double search_s = 0;  ///< outer lists and bodies
  double prune_s = 0;   ///< inner lists
  double pairs_s = 0, sum_s = 0, drift_s = 0;
  double bodies_s = 0;  ///< bodies, bonds, clumps
  std::uint64_t prunes = 0;
};

/// Grains out and grains in, between two steps; see World::Exchange.
struct GrainExchange {
  std::vector<std::int32_t> out;  ///< ids that leave
  std::vector<GrainState> in;
  /// History of a pair as `a` sees it. a, b >= 0: index into `in`; < 0: -1 - id
  /// of a grain that stays.
  struct Touch {
    std::int32_t a = 0, b = 0;
    std::array<float, kMaxHistoryWords> words = {};
  };
  struct BodyTouch {
    std::int32_t a = 0;  ///< index into `in`
    int body = 0;
    std::int32_t key = 0;
    std::array<float, kMaxHistoryWords> words = {};
  };
  std::vector<Touch> touches;
  std::vector<BodyTouch> body_touches;
};

}  // namespace grouser::dem
