#pragma once

#include <array>

#include "dem_offline/engine/laws/contact_model.h"

namespace grouser::dem {

/// Laws of the pairs 0-0, 0-1 and 1-1: histories of different lengths and signs, one that is
/// evaluated side by side, one with a range.
inline std::array<LawChoice, 3> ThreeLaws() {
  return {LawsByName("elasto_plastic", "mindlin_deresiewicz", "own_spin", "none"),
          LawsByName("linear_spring", "linear_history", "epsd", "none"),
          LawsByName("hertz_restitution", "mindlin", "constant_torque", "jkr")};
}

/// Two materials of grains and these laws.
inline ContactModel TwoMaterials(const std::array<LawChoice, 3>& laws) {
  ContactModel model;
  LawSettings settings;
  SettingsOf<ElastoPlastic>(settings).yield_force_n = 0.05;
  SettingsOf<LinearSpring>(settings).stiffness_n_per_m = 3000;
  ContactProperties f = {0.6, 0.5, 0.1};
  f.surface_energy_j_per_m2 = 0.02;
  model.AddMaterial({1e7, 0.3});
  model.AddMaterial({2e7, 0.25});
  for (const auto& [a, b] : {std::pair{0, 0}, std::pair{0, 1}, std::pair{1, 1}}) {
    model.SetContactProperties(a, b, f, settings, laws[a + b]);
  }
  return model;
}
inline ContactModel TwoMaterials(const LawChoice& laws) { return TwoMaterials({laws, laws, laws}); }

}  // namespace grouser::dem
