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

/// Beside mavs::vti::Brixius and CoarseGrained, with their ratios: tractions, resistance and
/// drawbar pull are over the load, though MavsVti's header says newtons. The soil is the model's,
/// and its wheel is rigid: cone index and deflection are not read, whether the wheel is powered
/// follows from the slip. MAVS' one caller, mavs::vti::Tire, holds a Brixius by value: it has to be
/// edited (docs/hosts.md). MavsVti has no virtual destructor: do not delete one of these through
/// it. The model outlives it.
class MavsSoilVti final : public mavs::vti::MavsVti {
 public:
  /// MavsVti leaves its numbers without a value: here they are the model's, and zeros until Update.
  explicit MavsSoilVti(const Model& model) : model_(model) {
    b_ = model.width_m();
    d_ = 2 * model.radius_m();
    h_ = 0;
    Keep();
  }

  /// Throws std::invalid_argument for a wheel that is over 1 % off the model's.
  void SetWheelProperties(double width, double diameter, double section_height) override {
    Check("diameter", diameter, 2 * model_.radius_m());
    Check("width", width, model_.width_m());
    b_ = width;
    d_ = diameter;
    h_ = section_height;
  }

  /// load [N], as mavs::vti::Tire passes it (the spring constant of its SpringTire times a length);
  /// the header of MavsVti says kN. Slip and slip angle alpha [rad] of StateOfVti.
  void Update(double /*rci*/, double load, double /*deflection*/, double slip,
              double alpha) override {
    answer_ = AskVti(model_, slip, alpha, load);
    Keep();
  }

  /// Of the last Update, with flags (grouser::Flag); zeros before the first.
  const VtiAnswer& answer() const { return answer_; }

 private:
  void Keep() {
    longi_traction_ = answer_.traction;
    longi_motion_resistance_ = answer_.resistance;
    drawbar_pull_ = answer_.pull;
    lat_traction_ = answer_.lateral;
    sinkage_ = answer_.sinkage;
  }
  static void Check(const char* what, double value, double own) {
    if (std::abs(value / own - 1) <= 0.01) return;
    throw std::invalid_argument(std::string("mavs: ") + what + ": got " + std::to_string(value) +
                                " m, expected the model's, " + std::to_string(own) + " m");
  }

  const Model& model_;
  VtiAnswer answer_{};
};

}  // namespace grouser
