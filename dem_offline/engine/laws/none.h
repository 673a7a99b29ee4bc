#pragma once

#include "dem_offline/engine/laws/law.h"

namespace grouser::dem {

/// No rolling resistance.
struct RollingNone {
  static constexpr const char* kName = "none";
  static constexpr unsigned kNeeds = 0;
  static constexpr bool kOwnSides = false;
  struct Settings {};
  template <class S, class V>
  static void Fields(S&, V&&) {}
  struct Params {};
  struct History {};
  static Params Make(const Elastic&, const Elastic&, const ContactProperties&, const Settings&) {
    return {};
  }
  static constexpr double kStepShare = 1;
  static SpringBound Bounds(const Params&, double, double, double) { return {}; }
  static GROUSER_HD RollingTerms Evaluate(const Params&, const ContactGeometry&, Vec3f,
                                          const NormalTerms&, History&, float) {
    return {{0.0f, 0.0f, 0.0f}, 0.0f, 0.0f};
  }
};

/// No cohesion: a contact is where grains overlap.
struct CohesionNone {
  static constexpr const char* kName = "none";
  static constexpr unsigned kNeeds = 0;
  static constexpr bool kHasRange = false;
  struct Settings {};
  template <class S, class V>
  static void Fields(S&, V&&) {}
  struct Params {};
  struct History {};
  static Params Make(const Elastic&, const Elastic&, const ContactProperties&, const Settings&) {
    return {};
  }
  static double Range(const Params&, double, double) { return 0; }
  static double Stiffness(const Params&, double, double) { return 0; }
  static GROUSER_HD CohesionTerms Evaluate(const Params&, const ContactGeometry& g, NormalTerms&,
                                           History&, float) {
    return {g.overlap > 0.0f, 0.0f};
  }
};

}  // namespace grouser::dem
