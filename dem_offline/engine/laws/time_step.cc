#include "dem_offline/engine/laws/time_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {
namespace {

constexpr double kFastestMode = 16, kUndampedMode = 28;
// (k_t + k_r/r^2)/k_n of the runs that these were fitted to: Mindlin's spring at Poisson's ratio
// 0.3, EPSD with rolling friction 0.3. Turning is the faster motion.
constexpr double kFittedTurning = 0.86;
constexpr double kRollingModes = 12;  // 6 contacts, each turned by both its grains
constexpr double kBodyMode = 4;       // sliding and rolling in one contact: 1 + 5/2 k_t/k_n
constexpr double kSphere = 0.4;       // I/(m r^2)

SpringBound Times(double factor, const SpringBound& b) {
  return {factor * b.stiffness, factor * b.damping};
}

/// Normal bound of a contact, raised to what its tangential and rolling springs ask for.
SpringBound Fastest(const ContactBounds& b, double radius) {
  const double turning =
      (b.tangential.stiffness + b.rolling.stiffness / (radius * radius)) / kFittedTurning;
  return {std::max(b.normal.stiffness, turning), std::max(b.normal.damping, b.tangential.damping)};
}

}  // namespace

double LeapfrogLimit(double mass, const SpringBound& b) {
  const double root = std::sqrt(b.damping * b.damping + 4 * b.stiffness * mass);
  return root > 0 ? 4 * mass / (b.damping + root) : std::numeric_limits<double>::infinity();
}

double PackedLimit(const ContactModel& contacts, double overlap_over_radius, double radius,
                   double mass, int of_grains) {
  const double overlap = overlap_over_radius * radius, inertia = kSphere * mass * radius * radius;
  double limit = std::numeric_limits<double>::infinity();
  const auto at_most = [&limit](double step) { limit = std::min(limit, step); };
  for (int a = 0; a < (of_grains < 0 ? contacts.materials() : of_grains); ++a) {
    for (int b = a; b < contacts.materials(); ++b) {
      if (!contacts.has_contact_properties(a, b)) continue;
      const ContactBounds body = contacts.Bounds(a, b, AtBody(overlap, radius, mass));
      at_most(LeapfrogLimit(mass, Times(kBodyMode, Fastest(body, radius))));
      at_most(LeapfrogLimit(inertia, body.rolling));
      if (contacts.material(a).youngs_modulus_pa == kRigid ||
          contacts.material(b).youngs_modulus_pa == kRigid) {
        continue;
      }
      const ContactBounds pair = contacts.Bounds(a, b, PairOf(overlap, radius, mass));
      const SpringBound fastest = Fastest(pair, radius);
      at_most(LeapfrogLimit(mass, Times(kFastestMode, fastest)));
      at_most(LeapfrogLimit(mass, {kUndampedMode * fastest.stiffness, 0}));
      at_most(LeapfrogLimit(inertia, Times(kRollingModes, pair.rolling)));
    }
  }
  return contacts.StepShare() * limit;
}

double CriticalStepOf(const ContactModel& contacts, double overlap, double radius, double mass) {
  const SpringBound most = contacts.Bounds(AtBody(overlap, radius, mass)).normal;
  const double spring = 0.2 * std::sqrt(mass / most.stiffness);
  return most.damping > 0 ? std::min(spring, mass / (8 * most.damping)) : spring;
}

double OverlapUnderForce(const ContactModel& contacts, int a, double force, double radius,
                         double mass) {
  const PairParams params = contacts.Table()[a * contacts.materials() + a];
  const ContactSize size = PairOf(0, radius, mass);
  ContactGeometry g = {};
  g.n = {0.0f, 0.0f, 1.0f};
  g.r_own = g.r_other = static_cast<float>(radius);
  g.r_eff = static_cast<float>(size.r_eff_m);
  g.m_own = static_cast<float>(mass);
  g.m_eff = static_cast<float>(size.m_eff_kg);
  g.roll_inertia = static_cast<float>(size.roll_inertia_kg_m2);
  double low = 0, high = 1;
  for (int k = 0; k < 40; ++k) {
    const double middle = 0.5 * (low + high);
    g.overlap = static_cast<float>(middle * radius);
    float words[kMaxHistoryWords] = {};
    const ContactResult r = EvaluateGeneric(contacts.layout(), params, g, words, 1.0f);
    (r.force.z < force ? low : high) = middle;
  }
  return high;
}

}  // namespace grouser::dem
