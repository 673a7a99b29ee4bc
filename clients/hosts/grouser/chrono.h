#pragma once

#include <chrono_vehicle/ChTerrain.h>
#include <chrono_vehicle/ChWorldFrame.h>
#include <chrono_vehicle/wheeled_vehicle/ChWheel.h>
#include <chrono_vehicle/wheeled_vehicle/tire/ChForceElementTire.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "grouser/timed_wheel.h"

/// A tyre of Project Chrono's vehicles (Chrono::Vehicle 9.0) on a model's soil: docs/hosts.md, also
/// on what of it was run. Everything but the translation of names stands in grouser/timed_wheel.h.
namespace grouser {

/// Ground: ChTerrain's height and normal under the wheel's centre; its friction is not read, for
/// the soil is the model's. Force and moment are found in Synchronize, of the wheel's state at that
/// time; Advance has nothing to do. When they reach the spindle is the caller's: ChWheeledVehicle
/// can apply them a step later (docs/hosts.md). The model outlives the tyre; its gravity has to be
/// the system's.
class ChronoSoilTire : public ::chrono::vehicle::ChForceElementTire {
 public:
  /// Mass [kg] and moments of inertia [kg m^2] are added to the spindle's. Throws as WheelContact,
  /// and for a mass or inertia that is not positive.
  ChronoSoilTire(const std::string& name, const Model& model, double mass,
                 const ::chrono::ChVector3d& inertia, const ContactOptions& options = {})
      : ChForceElementTire(name),
        model_(model),
        wheel_(model, options),
        mass_(mass),
        inertia_(inertia) {
    for (const double value : {mass, inertia.x(), inertia.y(), inertia.z()}) {
      if (value > 0) continue;
      throw std::invalid_argument("chrono: tyre '" + name + "': mass or inertia: got " +
                                  std::to_string(value) + ", expected more than 0");
    }
  }

  std::string GetTemplateName() const override { return "GrouserSoilTire"; }
  double GetRadius() const override { return model_.radius_m(); }
  double GetWidth() const override { return model_.width_m(); }
  double GetVisualizationWidth() const override { return model_.width_m(); }
  double GetTireMass() const override { return mass_; }
  ::chrono::ChVector3d GetTireInertia() const override { return inertia_; }
  /// Of the tyre against the rim, N_s/k of WheelContact; the soil's part is soil_force().sinkage
  /// less this. Damping deflects neither.
  double GetDeflection() const override {
    return wheel_.force().static_load / wheel_.contact().options().tyre_stiffness;
  }

  /// Throws std::runtime_error "chrono: tyre 'NAME', time T: ..." for a state that is not finite.
  /// GetLongitudinalSlip, GetSlipAngle and GetCamberAngle follow, also off the ground, as Chrono
  /// has them: (r w - v_x)/|v_x|, not the models' slip. Where axle and normal are parallel the last
  /// ones stay.
  void Synchronize(double time, const ::chrono::vehicle::ChTerrain& terrain) override {
    const ::chrono::vehicle::WheelState state = m_wheel->GetState();
    const WheelMotion motion = MotionOf(state, terrain);
    const WheelForce& force = wheel_.At(time, motion);
    if ((force.flags & kInvalid) != 0) {
      throw std::runtime_error("chrono: tyre '" + GetName() + "', time " + std::to_string(time) +
                               ": state or ground, expected finite numbers");
    }
    m_data = ContactData();
    m_tireforce = ::chrono::vehicle::TerrainForce();
    const ContactPatch patch = PatchOf(motion, force);
    if (!std::isfinite(patch.x[0])) return;  // axle and normal are parallel
    const auto& q = patch.rotation;
    const ::chrono::ChCoordsys<> frame(ToChrono(patch.point),
                                       ::chrono::ChQuaternion<>(q[0], q[1], q[2], q[3]));
    CalculateKinematics(state, frame);
    m_data.in_contact = force.load > 0;
    if (!m_data.in_contact) return;
    m_data.frame = frame;
    m_data.vel = ToChrono(patch.velocity);
    m_data.normal_force = force.load;
    m_data.depth = force.sinkage;
    m_tireforce.point = ToChrono(patch.point);
    m_tireforce.force = ToChrono(patch.force);
    m_tireforce.moment = ToChrono(patch.moment);
  }
  void Advance(double /*step*/) override {}

  /// Of the last Synchronize, with load, sinkage, slip and flags.
  const WheelForce& soil_force() const { return wheel_.force(); }

 protected:
  /// At the wheel's centre, global axes.
  ::chrono::vehicle::TerrainForce GetTireForce() const override {
    ::chrono::vehicle::TerrainForce out;
    if (!m_data.in_contact) return out;
    out.point = m_wheel->GetPos();
    out.force = ToChrono(wheel_.force().force);
    out.moment = ToChrono(wheel_.force().moment);
    return out;
  }
  /// Of a wheel that rolls freely at the training speed [N].
  double GetNormalStiffnessForce(double depth) const override {
    const double speed = model_.domain().speed_m_per_s;
    return LoadAtSinkage(model_, speed, 0, speed, depth, wheel_.contact().options().tyre_stiffness);
  }
  /// As WheelContact has it; `velocity`: of growing depth [m/s].
  double GetNormalDampingForce(double depth, double velocity) const override {
    if (depth <= 0) return 0;
    const double load = GetNormalStiffnessForce(depth);
    const double share = 2 * wheel_.contact().options().damping_ratio * velocity /
                         std::sqrt(model_.gravity_m_per_s2() * depth);
    return load * std::max(share, -1.0);  // a NaN stays
  }

 private:
  static ::chrono::ChVector3d ToChrono(const std::array<double, 3>& v) {
    return ::chrono::ChVector3d(v[0], v[1], v[2]);
  }
  static std::array<double, 3> FromChrono(const ::chrono::ChVector3d& v) {
    return {v.x(), v.y(), v.z()};
  }
  static WheelMotion MotionOf(const ::chrono::vehicle::WheelState& state,
                              const ::chrono::vehicle::ChTerrain& terrain) {
    using ::chrono::vehicle::ChWorldFrame;
    const double up = terrain.GetHeight(state.pos) - ChWorldFrame::Height(state.pos);
    WheelMotion motion;
    motion.centre = FromChrono(state.pos);
    motion.axle = FromChrono(state.rot.Rotate(::chrono::ChVector3d(0, 1, 0)));
    motion.velocity = FromChrono(state.lin_vel);
    motion.angular_velocity = FromChrono(state.ang_vel);
    motion.ground_point =
        timed_wheel::Plus(motion.centre, up, FromChrono(ChWorldFrame::Vertical()));
    motion.ground_normal = FromChrono(terrain.GetNormal(state.pos));
    return motion;
  }

  const Model& model_;
  TimedWheel wheel_;
  double mass_;
  ::chrono::ChVector3d inertia_;
};

}  // namespace grouser
