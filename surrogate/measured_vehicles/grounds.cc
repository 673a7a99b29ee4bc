#include "surrogate/measured_vehicles/grounds.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "surrogate/models/hybrid.h"
#include "surrogate/vehicle/vehicle_file.h"

namespace grouser::measured {
namespace {

using vehicle::Motion, vehicle::Solution, vehicle::Vehicle, vehicle::WheelType;
using Made = std::unique_ptr<const surrogate::WheelModel>;

// No runs stand behind the law: it is asked for everything, and its intervals for nothing.
constexpr double kLeastLoad = 1, kMostLoad = 1e5;
constexpr double kTableLoads = 4;     // a table's loads: the usual one over and times this
constexpr double kMostRadius = 1000;  // of a substitute wheel, over the tyre's

/// A model of a larger wheel in place of a tyre: its torque is that of the tyre's own radius.
class SubstituteWheel final : public surrogate::WheelModel {
 public:
  SubstituteWheel(surrogate::HybridModel model, double torque_share)
      : model_(std::move(model)), torque_share_(torque_share) {}

  void Evaluate(const surrogate::WheelStatesView& in,
                const surrogate::ResponsesView& out) const noexcept override {
    model_.Evaluate(in, out);
    const surrogate::OutputView& torque = out.output[surrogate::kTorque];
    for (const auto part : surrogate::kPartMembers) {
      for (double& x : torque.*part) x *= torque_share_;
    }
  }

 private:
  surrogate::HybridModel model_;
  double torque_share_;
};

// Radius r* of Wheels::kTyres, by halving in ln r*: the larger the wheel, the less it sinks.
double SubstituteRadius(const surrogate::BekkerParameters& soil, const WheelType& wheel,
                        double load) {
  surrogate::HardGround contact;
  surrogate::SetUsualContact(wheel.radius_m, wheel.width_m, &contact);
  const double half = contact.contact_length_m / 2;
  const double deflection = half * half / (2 * wheel.radius_m);
  double low = wheel.radius_m, high = kMostRadius * wheel.radius_m;
  for (int i = 0; i < 40; ++i) {
    const double radius = std::sqrt(low * high);
    const surrogate::BekkerModel model(soil, {radius, wheel.width_m});
    const double sinkage = model.Solve(1, 0, 1, load).value[surrogate::kSinkage];
    (radius < wheel.radius_m * (1 + deflection / sinkage) ? low : high) = radius;
  }
  return low;
}

Made Bekker(const surrogate::Soil& soil, const Vehicle& vehicle, const WheelType& wheel,
            Wheels wheels) {
  const double gravity = vehicle.gravity_m_per_s2;
  const double load = vehicle.mass_kg * gravity / static_cast<double>(vehicle.wheels.size());
  const surrogate::BekkerParameters parameters = surrogate::FromSoil(soil, gravity);
  const double radius =
      wheels == Wheels::kRigid ? wheel.radius_m : SubstituteRadius(parameters, wheel, load);
  surrogate::TrainingDomain all;
  all.attack_angle_max_rad = std::numbers::pi / 2;
  const bool table = wheels == Wheels::kTabulatedTyres;
  all.load_min_n = table ? load / kTableLoads : kLeastLoad;
  all.load_max_n = table ? load * kTableLoads : kMostLoad;
  all.gravity_m_per_s2 = gravity;
  surrogate::HybridModel model(surrogate::BekkerModel(parameters, {radius, wheel.width_m}),
                               surrogate::ResidualTable(), all, surrogate::Uncertainty{});
  if (table) {
    model.Tabulate();
  } else {
    model.AnswerByLaw();
  }
  return std::make_unique<SubstituteWheel>(std::move(model), wheel.radius_m / radius);
}

Made Hard(surrogate::HardGround ground, const WheelType& wheel) {
  surrogate::SetUsualContact(wheel.radius_m, wheel.width_m, &ground);
  return std::make_unique<surrogate::HardGroundModel>(ground, wheel.radius_m);
}

vehicle::Grounds GroundsOf(const std::vector<Made>& models) {
  vehicle::Grounds grounds;
  grounds.soils = {"ground"};
  for (const Made& model : models) grounds.models.push_back(model.get());
  return grounds;
}

std::unique_ptr<vehicle::Solver> SolverOf(const Vehicle& vehicle, std::vector<Made>* models,
                                          const std::function<Made(const WheelType&)>& make) {
  for (const WheelType& wheel : vehicle.wheel_types) models->push_back(make(wheel));
  return std::make_unique<vehicle::Solver>(vehicle, GroundsOf(*models));
}

}  // namespace

OnGround::OnGround(const Vehicle& vehicle, const surrogate::HardGround& ground)
    : solver_(SolverOf(vehicle, &models_, [&](const WheelType& w) { return Hard(ground, w); })) {}

OnGround::OnGround(const Vehicle& vehicle, const surrogate::Soil& soil, Wheels wheels)
    : solver_(SolverOf(vehicle, &models_,
                       [&](const WheelType& w) { return Bekker(soil, vehicle, w, wheels); })) {}

std::vector<Solution> OnGround::Turn(const std::vector<double>& left,
                                     const std::vector<double>& right, int draw) {
  std::vector<Motion> motions(left.size());
  for (std::size_t i = 0; i < left.size(); ++i) {
    motions[i].given = Motion::Given::kControls;
    motions[i].rim_speed_m_per_s[0] = left[i];
    motions[i].rim_speed_m_per_s[1] = right[i];
    motions[i].draw = draw;
  }
  std::vector<Solution> solved(left.size());
  solver_->Solve(motions, solved);
  return solved;
}

Solution OnGround::Straight(double speed) {
  const Motion motion = Motion::OnPath(speed, 0);
  Solution solved;
  solver_->Solve({&motion, 1}, {&solved, 1});
  return solved;
}

vehicle::Grounds OnGround::grounds() const { return GroundsOf(models_); }

Vehicle Shipped(const std::string& name) {
  return vehicle::ReadVehicle(surrogate::SurrogateFile("vehicle/shipped/" + name + ".vehicle.yaml"))
      .vehicle;
}

surrogate::Soil WithFriction(surrogate::Soil soil, double friction) {
  soil.friction_angle_rad = std::atan(friction);
  return soil;
}

double TorqueOf(const Vehicle& vehicle, const Solution& solution, int drive) {
  double torque = 0;
  for (std::size_t i = 0; i < vehicle.wheels.size(); ++i) {
    if (vehicle.wheels[i].drive == drive) torque += solution.wheel[i].torque_n_m;
  }
  return torque;
}

}  // namespace grouser::measured
