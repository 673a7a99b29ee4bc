#pragma once

#include <cstddef>
#include <memory>

#include "server/vehicle/call_vehicle.h"

namespace grouser::server {

/// Draws of a vehicle's grounds for one call: those who use them forget them at its end, so that
/// their memory is given back.
class CallDraws {
 public:
  CallDraws(const CallVehicle& v, std::size_t count) {
    if (count > 0) draws_ = std::make_shared<const vehicle::GroundDraws>(v.file().grounds, count);
  }
  CallDraws(const CallDraws&) = delete;
  ~CallDraws() {
    if (solver_ != nullptr) solver_->UseDraws(nullptr);
    if (planner_ != nullptr) planner_->UseDraws(nullptr);
  }
  explicit operator bool() const { return draws_ != nullptr; }
  void For(vehicle::Solver* solver) {
    if (draws_ == nullptr) return;
    solver_ = solver;
    solver->UseDraws(draws_);
  }
  void For(vehicle::SpeedPlanner* planner) {
    if (draws_ == nullptr) return;
    planner_ = planner;
    planner->UseDraws(draws_);
  }

 private:
  std::shared_ptr<const vehicle::GroundDraws> draws_;
  vehicle::Solver* solver_ = nullptr;
  vehicle::SpeedPlanner* planner_ = nullptr;
};

}  // namespace grouser::server
