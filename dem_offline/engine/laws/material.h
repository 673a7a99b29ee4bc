#pragma once

#include "dem_offline/engine/laws/recipe.h"

namespace grouser::dem {

/// Isotropic elastic solid. Infinite modulus: rigid.
struct Elastic {
  double youngs_modulus_pa = 0;
  double poisson_ratio = 0;
};

/// Interface numbers of a pair of materials.
struct Interface {
  double restitution = 0.5;
  double friction = 0.5;
  double rolling_friction = 0.1;
  double rolling_damping = 0.3;  ///< eta of EPSD; Ai et al. 2011 use 0.3
};

/// E* and G* of two bodies: 1/E* = sum (1 - nu^2)/E, 1/G* = sum 2 (2 - nu)(1 +
/// nu)/E; a rigid partner adds nothing. D = -2 sqrt(5/6) beta(e).
/// Throws std::invalid_argument for e outside (0, 1], negative friction, E <= 0
/// or nu outside (-1, 0.5].
HertzMindlinEpsd::Params MakeParams(const Elastic& a, const Elastic& b, const Interface& f);
/// Against a rigid wall.
HertzMindlinEpsd::Params MakeWallParams(const Elastic& a, const Interface& f);

}  // namespace grouser::dem
