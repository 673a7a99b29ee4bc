#pragma once

#include <cstdint>

#include "dem_offline/engine/bodies/body.h"
#include "dem_offline/engine/core/rotation.h"

// How rigid bodies move, and what is kept of them from step to step: index
// bodies that all back ends share.

namespace grouser::dem {

/// Force and moment of the grains on a body, at its origin [N, N m], world
/// axes; summed in double in a fixed order.
struct Wrench {
  double fx = 0, fy = 0, fz = 0, tx = 0, ty = 0, tz = 0;
  GROUSER_HD void Add(const Wrench& o) {
    fx += o.fx, fy += o.fy, fz += o.fz;
    tx += o.tx, ty += o.ty, tz += o.tz;
  }
  GROUSER_HD void Add(Vec3f force, Vec3f moment) {
    fx += force.x, fy += force.y, fz += force.z;
    tx += moment.x, ty += moment.y, tz += moment.z;
  }
};

struct BodyTrack {
  Vec3d angular_momentum = {0, 0, 0};  ///< kFree: of the half step
  Wrench wrench;
  double work_j = 0;
  double margin_m = 0, moved_m = 0;  ///< search margin; motion since the last search
  Vec3d left_at = {0, 0, 0};         ///< pose after the last step: who is put elsewhere
  Quatd left_turned = {1, 0, 0, 0};  ///< by hand is searched for anew
  bool turning = false;              ///< was the last search for a body that may turn?
};

/// What a body needs to know of its world.
struct BodySurroundings {
  Vec3d gravity_m_per_s2;
  double dt_s, skin_m;
  bool planar;
};

GROUSER_HD bool Same(const double* a, const double* b, int n) {
  for (int k = 0; k < n; ++k) {
    if (a[k] != b[k]) return false;
  }
  return true;
}

GROUSER_HD Vec3d ForceOn(const RigidBody& b, const Wrench& w, const Vec3d& g) {
  const double m = b.mass_kg;
  return {w.fx + m * g[0] + b.outer_force_n[0], w.fy + m * g[1] + b.outer_force_n[1],
          w.fz + m * g[2] + b.outer_force_n[2]};
}
GROUSER_HD Vec3d MomentOn(const RigidBody& b, const Wrench& w) {
  return Add({w.tx, w.ty, w.tz}, b.outer_moment_n_m);
}

/// Bound of how far a surface point goes in a step [m]; axle: turning about y
/// counts. reach: Shape::reach. Infinite for a plane that turns.
GROUSER_HD double TravelOf(const RigidBody& b, double reach, double dt_s, bool axle) {
  Vec3d turn = b.spin_rad_per_s;
  if (!axle) {
    const Vec3d y = MatrixOf(b.orientation) * Vec3d{0, 1, 0};
    turn = Sub(turn, Scale(DotD(turn, y), y));
  }
  const double rate = Norm(turn);
  return dt_s * (Norm(b.velocity_m_per_s) + (rate > 0 ? rate * reach : 0.0));
}

/// One step of a body under the wrench of the last; true: it has to be searched
/// for anew.
GROUSER_HD bool MoveBody(const BodySurroundings& around, double reach, RigidBody* b, BodyTrack* t) {
  const double dt = around.dt_s;
  const bool put = !Same(&b->position_m[0], &t->left_at[0], 3) ||
                   !Same(&b->orientation[0], &t->left_turned[0], 4);
  bool search = put;
  if (b->motion != BodyMotion::kFixed) {
    if (b->motion == BodyMotion::kFree) {
      b->velocity_m_per_s =
          Add(b->velocity_m_per_s,
              Scale(dt / b->mass_kg, ForceOn(*b, t->wrench, around.gravity_m_per_s2)));
      t->angular_momentum = Add(t->angular_momentum, Scale(dt, MomentOn(*b, t->wrench)));
      if (around.planar) {
        b->velocity_m_per_s[1] = 0;
        t->angular_momentum[0] = t->angular_momentum[2] = 0;
      }
      b->orientation =
          TurnFreely(b->orientation, t->angular_momentum, b->inertia_kg_m2, dt, &b->spin_rad_per_s);
    } else if (DotD(b->spin_rad_per_s, b->spin_rad_per_s) > 0) {
      b->orientation = Turn(b->orientation, b->spin_rad_per_s, dt);
    }
    b->position_m = Add(b->position_m, Scale(dt, b->velocity_m_per_s));
    t->moved_m += TravelOf(*b, reach, dt, false);
    // Grains move at most half a skin between searches.
    const bool starts = !t->turning && DotD(b->spin_rad_per_s, b->spin_rad_per_s) > 0;
    search = put || starts || t->moved_m + 0.5 * around.skin_m > t->margin_m;
  }
  t->left_at = b->position_m;
  t->left_turned = b->orientation;
  return search;
}

/// Velocities of time zero to the half step before.
GROUSER_HD void StepBodyBack(const BodySurroundings& around, RigidBody* b, BodyTrack* t) {
  if (b->motion != BodyMotion::kFree) return;
  const double half = 0.5 * around.dt_s;
  b->velocity_m_per_s =
      Sub(b->velocity_m_per_s,
          Scale(half / b->mass_kg, ForceOn(*b, t->wrench, around.gravity_m_per_s2)));
  t->angular_momentum = Sub(t->angular_momentum, Scale(half, MomentOn(*b, t->wrench)));
}

/// Work of the body on the grains in a step, by the mean of the wrenches before and after it.
GROUSER_HD void BookWork(const RigidBody& b, double dt_s, const Wrench& before, BodyTrack* t) {
  const Vec3d &v = b.velocity_m_per_s, &o = b.spin_rad_per_s;
  if (b.motion == BodyMotion::kPrescribed) {
    Wrench f = t->wrench;
    f.Add(before);
    t->work_j -=
        0.5 * dt_s *
        (f.fx * v[0] + f.fy * v[1] + f.fz * v[2] + f.tx * o[0] + f.ty * o[1] + f.tz * o[2]);
  } else if (b.motion == BodyMotion::kFree) {
    t->work_j += dt_s * (DotD(b.outer_force_n, v) + DotD(b.outer_moment_n_m, o));
  }
}

}  // namespace grouser::dem
