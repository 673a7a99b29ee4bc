#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "clients/cpp/access.h"
#include "surrogate/vehicle/messages.h"
#include "surrogate/vehicle/trajectory.h"

namespace grouser::cli {

/// One motion on coherent draws of the ground.
struct MotionOnDraws {
  std::vector<vehicle::Solution> solutions;  ///< by draw
  vehicle::GoProbability go;                 ///< shares of the draws
};
/// The same of a plan.
struct PlanOnDraws {
  std::size_t draws = 0;   ///< asked for; 0: none
  double holds = 0;        ///< share of them on which all points hold
  std::vector<double> at;  ///< by point
};

/// Who answers for a vehicle: a file in this process, or a server. The answers are the same, bit
/// for bit; what is printed is made of them in one place.
class VehicleAnswers {
 public:
  virtual ~VehicleAnswers() = default;
  const vehicle::DescribedVehicle& described() const { return described_; }

  /// One more soil, named by this text: "{NAME: WEIGHT, ...}". Throws InputError, and
  /// std::invalid_argument as vehicle::AddMixture; a server says so at the next question.
  virtual void AddMixture(const std::string& text) = 0;

  /// With the probability that every limit of the vehicle holds.
  virtual vehicle::Solution Solve(const vehicle::Motion& motion, vehicle::GoProbability* go) = 0;
  virtual MotionOnDraws SolveOnDraws(const vehicle::Motion& motion, std::size_t draws) = 0;
  virtual std::vector<vehicle::PowerInterval> Energies(
      std::span<const vehicle::Motion> motions) = 0;
  /// With the interval of Energies.
  virtual std::vector<vehicle::TrajectoryCost> Costs(
      std::span<const std::vector<vehicle::TrajectoryStep>> trajectories) = 0;
  /// Returns at how many points the plan does not hold.
  virtual std::size_t Plan(std::span<const vehicle::PathPoint> path,
                           const vehicle::SpeedOptions& options, std::span<vehicle::SpeedPoint> out,
                           PlanOnDraws* on_draws) = 0;
  virtual vehicle::GradeRange Grades(double speed, std::uint8_t soil,
                                     const vehicle::SpeedOptions& options) = 0;
  /// Of soils of described(); none: of each. Of a server not of soils of AddMixture, which its call
  /// does not take: std::invalid_argument.
  virtual std::vector<vehicle::SkidConstants> Constants(std::span<const double> speeds,
                                                        std::span<const double> radii,
                                                        std::span<const std::uint8_t> soils) = 0;

 protected:
  vehicle::DescribedVehicle described_;
};

/// The vehicle of a file. Throws as vehicle::ReadVehicle.
std::unique_ptr<VehicleAnswers> AnswersOfFile(const std::string& file);

/// A server of VehicleService.
struct VehicleServer {
  std::string address;
  int deadline_ms = 10000;
  client::Access access;
};
/// The vehicle of a name on a server. Throws client::ClientError; std::runtime_error where this
/// program was built without gRPC.
std::unique_ptr<VehicleAnswers> AnswersOfServer(const VehicleServer& server,
                                                const std::string& name);
/// Names of its vehicles with what is known of them, a line each.
std::string ListVehicles(const VehicleServer& server);

}  // namespace grouser::cli
