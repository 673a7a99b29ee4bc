#pragma once

#include <cmath>

#include "surrogate/models/bekker.h"

namespace grouser::surrogate::bekker {

inline double Tan(double x) { return std::tan(x); }
template <int N>
Dual<double, N> Tan(const Dual<double, N>& x) {
  const double t = std::tan(x.v);
  return Chain(x, t, 1 + t * t);
}

/// ln k of sigma = k (h/S)^n, k in N/m^(n+2), in either form. get: see MakeLaw.
template <class P, class Get>
P LogModulus(const Get& get, double width) {
  using S = BekkerParameters;
  if (Value(get(&S::pressure_form)) == kBekkerForm) {
    return Log(P(get(&S::k_c) * (1 / width) + get(&S::k_phi)));
  }
  const P pressure =
      get(&S::cohesion) * get(&S::reece_k_c) + get(&S::unit_weight) * width * get(&S::reece_k_phi);
  return Log(pressure) - get(&S::n) * std::log(width);
}

/// The law's constants. get(&BekkerParameters::name) returns a parameter as P, with
/// whatever derivatives P has. Precondition: parameters that BekkerModel takes.
template <class P, class Get>
BekkerLaw<P> MakeLaw(const Get& get, const WheelGeometry& wheel) {
  using S = BekkerParameters;
  const P cohesion = get(&S::cohesion), weight = get(&S::unit_weight);
  BekkerLaw<P> a;
  a.radius = wheel.radius_m;
  a.width = wheel.width_m;
  a.theta_max = 2 * std::asin(std::sqrt(0.5 * kMostSinkage));
  a.log_modulus = LogModulus<P>(get, wheel.width_m);
  a.n = get(&S::n);
  a.cohesion = cohesion;
  a.cohesive = Value(cohesion) > 0 || !Plain<P>;
  a.inv_cohesion = 1.0 / Max(cohesion, Constant<P>(1e-30));
  a.friction = Tan(get(&S::friction_angle));
  a.inv_shear = 1.0 / get(&S::shear_modulus);
  a.inv_bulldozing = 1.0 / get(&S::bulldozing_length);
  a.shear_over_bulldozing = get(&S::shear_modulus) * a.inv_bulldozing;
  a.c1 = get(&S::c1);
  a.c2 = get(&S::c2);
  a.c3 = get(&S::c3);
  a.sinkage_drive = get(&S::sinkage_drive);
  a.sinkage_brake = get(&S::sinkage_brake);
  a.sinkage_lateral = get(&S::sinkage_lateral);
  a.turn_spin = get(&S::turn_spin);
  a.inv_turn_speed = 1.0 / get(&S::turn_speed);
  const P side = get(&S::side_passive), front = get(&S::front_passive);
  a.side_square = 0.5 * (weight * side);
  a.side_linear = 2.0 * (cohesion * Sqrt(side));
  a.front_square = 0.5 * (weight * front);
  a.front_linear = 2.0 * (cohesion * Sqrt(front));
  a.traction = 1.0 + get(&S::grouser_share) * get(&S::grouser_height) * (1 / wheel.radius_m);
  return a;
}

}  // namespace grouser::surrogate::bekker
