#pragma once

#include "dem_offline/engine/core/vec3.h"

namespace grouser::dem {

/// Energy of contacts by channel [J]: elastic energy that they hold, and what they dissipate.
template <class T>
struct EnergyChannels {
  T stored = 0, normal_damping = 0, tangent_damping = 0, slip = 0, rolling = 0, plastic = 0,
    cohesion = 0;
  template <class U>
  GROUSER_HD void Add(const EnergyChannels<U>& o) {
    stored += static_cast<T>(o.stored);
    normal_damping += static_cast<T>(o.normal_damping);
    tangent_damping += static_cast<T>(o.tangent_damping);
    slip += static_cast<T>(o.slip);
    rolling += static_cast<T>(o.rolling);
    plastic += static_cast<T>(o.plastic);
    cohesion += static_cast<T>(o.cohesion);
  }
  /// Another step: what is dissipated adds up, what is stored is the present.
  GROUSER_HD void AddStep(const EnergyChannels& step) {
    Add(step);
    stored = step.stored;
  }
};

/// Of one contact in one step; zero where there is none, but for what a breaking neck takes.
using ContactEnergy = EnergyChannels<float>;
/// Of many contacts in one step; or stored at present, and the others since the start.
using EnergySums = EnergyChannels<double>;

}  // namespace grouser::dem
