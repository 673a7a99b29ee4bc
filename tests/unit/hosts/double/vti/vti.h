// A stand-in for mavs::vti::MavsVti (MAVS, commit 3cb9febd), after its documented interface. It is
// no part of MAVS: docs/hosts.md.
#pragma once

namespace mavs::vti {

class MavsVti {
 public:
  MavsVti() : powered_(true) {}  // the other numbers have no value, as in MAVS
  virtual void SetWheelProperties(double, double, double) {}  // no virtual destructor, as in MAVS
  virtual void Update(double, double, double, double, double) {}
  void SetPowered(bool powered) { powered_ = powered; }
  double GetLongitudinalMotionResistance() { return longi_motion_resistance_; }
  double GetDrawbarPull() { return drawbar_pull_; }
  double GetLongitudinalTraction() { return longi_traction_; }
  double GetLateralTraction() { return lat_traction_; }
  double GetSinkage() { return sinkage_; }

 protected:
  double b_, d_, h_;
  bool powered_;
  double drawbar_pull_, sinkage_, longi_motion_resistance_, longi_traction_, lat_traction_;
};

}  // namespace mavs::vti
