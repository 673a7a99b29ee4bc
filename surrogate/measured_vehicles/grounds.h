#pragma once

#include <memory>
#include <string>
#include <vector>

#include "surrogate/soils/hard_table.h"
#include "surrogate/soils/soil_table.h"
#include "surrogate/vehicle/solver.h"

namespace grouser::measured {

/// What a wheel is on soil.
enum class Wheels {
  kRigid,
  /// A tyre that flattens as long as its usual contact on hard ground says (SetUsualContact: by
  /// d = a^2/(2 r)) acts on soil like a rigid wheel of the radius r* = r (1 + d/z), z its sinkage:
  /// the parabolas of equal length of contact, 2 r* z = 2 r (z + d). z is that of straight rolling
  /// at the share of the weight of one wheel; torque counts with r. The substitute circle is
  /// Bekker's idea; Harnisch et al. 2005 (Vehicle System Dynamics 43, suppl.) give it for any tyre.
  kTyres,
  /// The same, its law answered from a table around the usual load of a wheel
  /// (HybridModel::Tabulate) instead of solved at every state.
  kTabulatedTyres
};

/// One ground under all wheels of a vehicle, and its solver. Nothing is fitted to the wheels.
class OnGround {
 public:
  /// Published hard ground; the contact patch is the usual one of the wheel.
  OnGround(const vehicle::Vehicle& vehicle, const surrogate::HardGround& ground);
  /// A `bekker` model of a published soil, untuned (surrogate::FromSoil), under rigid wheels or
  /// tyres.
  OnGround(const vehicle::Vehicle& vehicle, const surrogate::Soil& soil, Wheels wheels);

  /// The twist of given rim speeds of two sides (on a draw of the solver's), or of steady straight
  /// driving.
  std::vector<vehicle::Solution> Turn(const std::vector<double>& left,
                                      const std::vector<double>& right,
                                      int draw = vehicle::Motion::kMeanGround);
  vehicle::Solution Straight(double speed);

  vehicle::Solver& solver() { return *solver_; }
  /// For other solvers and planners of the same vehicle, while this lives.
  vehicle::Grounds grounds() const;
  const vehicle::Vehicle& vehicle() const { return solver_->vehicle(); }

 private:
  std::vector<std::unique_ptr<const surrogate::WheelModel>> models_;
  std::unique_ptr<vehicle::Solver> solver_;
};

/// A shipped vehicle, by its name. Throws records::InputError.
vehicle::Vehicle Shipped(const std::string& name);

/// A soil with another angle of internal friction, tan(angle) = friction.
surrogate::Soil WithFriction(surrogate::Soil soil, double friction);

/// Sum of the drive torques of the wheels of a drive [N m].
double TorqueOf(const vehicle::Vehicle& vehicle, const vehicle::Solution& solution, int drive);

}  // namespace grouser::measured
