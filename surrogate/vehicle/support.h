#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "surrogate/vehicle/pack.h"
#include "surrogate/vehicle/vehicle.h"

namespace grouser::vehicle {

/// What the ground has to carry: the sum of wheel loads, and of loads times x and y.
struct Resultant {
  double load = 0, by_x = 0, by_y = 0;
};

/// Loads of the wheels and how they change with the resultant.
struct Loads {
  std::array<double, kMostWheels> load;
  std::array<Resultant, kMostWheels> slope;  ///< d load_i by each part of the resultant
  /// 1: over the middle of the wheels, 0: on the edge of the support polygon, below: tips.
  double tip_margin;
};

/// How a chassis spreads its weight over its wheels: a rigid body on springs that only push,
///   N_i = max(0, k_i (A + B X_i + C q_i Y_i)),
/// k the relative stiffness, q the roll share, (X, Y) the place of the wheel or the mean place of
/// its bogie; A, B, C balance the resultant. Linear while all wheels touch, continuous and
/// piecewise linear where some lift off. Three wheels: statics alone.
class Support {
 public:
  /// Precondition: Check(vehicle) passed.
  explicit Support(const Vehicle& vehicle);

  /// For a resultant outside of the support polygon, loads are those of the nearest point inside
  /// on the way to the middle, and tip_margin is negative. Precondition: load > 0.
  void Spread(const Resultant& resultant, Loads* out) const noexcept;

  /// Writes the polygon, and the loads where all wheels are down.
  void Describe(pack::Body* body) const noexcept;

  /// Length of the polygon's way from the middle to where gravity's line meets its edge.
  double TipMargin(double x, double y) const noexcept;

 private:
  bool Balance(unsigned touching, bool shared, const Resultant& r, Loads* out,
               double* heights) const noexcept;

  std::size_t n_;
  std::array<double, kMostWheels> x_{}, y_{}, stiffness_{}, roll_{};
  std::array<Resultant, kMostWheels> all_{};  // slopes with all wheels down
  double middle_x_ = 0, middle_y_ = 0;
  // Edges of the polygon, anticlockwise: a x + b y <= 1 from the middle.
  std::array<double, kMostWheels> edge_x_{}, edge_y_{};
  std::size_t edges_ = 0;
};

}  // namespace grouser::vehicle
