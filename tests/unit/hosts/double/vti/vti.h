// A stand-in for mavs::vti::MavsVti (MAVS, commit 3cb9febd), after its documented interface. It is
// no part of MAVS: docs/hosts.md.
#pragma once

namespace mavs::vti {

class MavsVti {
 public:
  virtual ~MavsVti() = default;
  virtual void SetWheelProperties(double, double, double) {}
  virtual void Update(double, double, double, double, double) {}
  double GetLongitudinalMotionResistance() { return longi_motion_resistance_; }
  double GetDrawbarPull() { return drawbar_pull_; }
  double GetLongitudinalTraction() { return longi_traction_; }
  double GetLateralTraction() { return lat_traction_; }
  double GetSinkage() { return sinkage_; }

 protected:
  double b_ = 0, d_ = 0, h_ = 0;
  double drawbar_pull_ = 0, sinkage_ = 0, longi_motion_resistance_ = 0, longi_traction_ = 0,
         lat_traction_ = 0;
};

}  // namespace mavs::vti
