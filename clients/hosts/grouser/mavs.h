#pragma once

#include <vti/vti.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "grouser/vti.h"

/// A model as a vehicle-terrain interaction of MAVS, the MSU Autonomous Vehicle Simulator (class
/// mavs::vti::MavsVti, as of commit 3cb9febd of github.com/Mississippi-State-University-OTM/MAVS):
/// docs/hosts.md, also on what of it was run.
namespace grouser {

/// In the place of mavs::vti::Brixius and CoarseGrained, with their units: load in kN; tractions,
/// resistance and drawbar pull are ratios to the load, as theirs are. The soil is the model's, and
/// its wheel is rigid: cone index and deflection are not read, whether the wheel is powered follows
/// from the slip. The model outlives it.
class MavsSoilVti : public mavs::vti::MavsVti {
 public:
  explicit MavsSoilVti(const Model& model) : model_(model) {}

  /// Throws std::invalid_argument for a wheel that is over 1 % off the model's.
  void SetWheelProperties(double width, double diameter, double section_height) override {
    Check("diameter", diameter, 2 * model_.radius_m());
    Check("width", width, model_.width_m());
    b_ = width;
    d_ = diameter;
    h_ = section_height;
  }

  void Update(double /*rci*/, double load_kn, double /*deflection*/, double slip,
              double alpha) override {
    answer_ = AskVti(model_, slip, alpha, 1e3 * load_kn);
    longi_traction_ = answer_.traction;
    longi_motion_resistance_ = answer_.resistance;
    drawbar_pull_ = answer_.pull;
    lat_traction_ = answer_.lateral;
    sinkage_ = answer_.sinkage;
  }

  /// Of the last Update, with flags (grouser::Flag).
  const VtiAnswer& answer() const { return answer_; }

 private:
  static void Check(const char* what, double value, double own) {
    if (std::abs(value / own - 1) <= 0.01) return;
    throw std::invalid_argument(std::string("mavs: ") + what + ": got " + std::to_string(value) +
                                " m, expected the model's, " + std::to_string(own) + " m");
  }

  const Model& model_;
  VtiAnswer answer_{};
};

}  // namespace grouser
