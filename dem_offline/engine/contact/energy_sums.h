#pragma once

#include "dem_offline/engine/laws/vec3.h"

namespace grouser::dem {

/// Energy of one sweep [J]; or stored at present, and the others over many.
struct EnergySums {
  double stored = 0, normal_damping = 0, tangent_damping = 0, slip = 0, rolling = 0, plastic = 0,
         cohesion = 0;
  GROUSER_HD void Add(const EnergySums& o) {
    stored += o.stored;
    normal_damping += o.normal_damping;
    tangent_damping += o.tangent_damping;
    slip += o.slip;
    rolling += o.rolling;
    plastic += o.plastic;
    cohesion += o.cohesion;
  }
  /// Another step: what is dissipated adds up, what is stored is the present.
  GROUSER_HD void AddStep(const EnergySums& step) {
    Add(step);
    stored = step.stored;
  }
};

}  // namespace grouser::dem
