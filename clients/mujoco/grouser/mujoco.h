#pragma once

#include <mujoco/mujoco.h>

#include <span>
#include <string>
#include <vector>

#include "grouser/contact.h"

/// Soil under the wheels of a MuJoCo model, as passive forces (docs/mujoco.md). Link the target
/// grouser::mujoco.
namespace grouser::mujoco {

/// Bodies of one kind of wheel. Each has one hinge joint, about which it turns, and no geom (nor
/// has a body fixed to it) that collides with the ground: the soil carries it.
struct Wheels {
  std::string bodies;            ///< a name, or a pattern as of the shell: "wheel_*"
  const Model* model = nullptr;  ///< of wheel and soil; outlives the SoilContact
  ContactOptions options{};
};

/// Forces of the soil on all wheels of one mjModel, in one mjData or in many.
///
/// Ground: a geom of the type plane, or hfield: the mean height and slope of four points under the
/// wheel, half a radius before and behind and half a width left and right of its centre, each
/// between its four data (bilinear). Beyond the edge of a height field there is no ground. It does
/// not move.
///
/// What wheels remember (ContactState) stands in mjData::userdata, UserData(wheels) numbers from
/// userdata_offset on: the model needs <size nuserdata="N"/>. So mj_copyData and mj_resetData keep
/// wheels and soil together. An integrator of several stages (RK4) advances it at each stage.
///
/// Between mj_step1 and mj_step2 (Apply), or from within MuJoCo (PassiveForces). One for each
/// thread.
class SoilContact {
 public:
  /// Throws std::invalid_argument "mujoco: WHAT: got X, expected Y" for names that are not there
  /// (with the names there are), bodies that are no wheels, a radius (of the largest cylinder or
  /// sphere of a wheel) or a gravity that is over 1 % off the model's (Model::Scaled makes one that
  /// fits), a ground that can move or has less than 2 x 2 heights, too little userdata.
  SoilContact(const mjModel* m, std::vector<Wheels> wheels, const std::string& ground_geom,
              int userdata_offset = 0);

  /// Adds the forces to qfrc_passive, and steps what wheels remember up to d->time. Again at the
  /// same time: the same forces. Where d->time went back, or userdata is as mj_resetData leaves it
  /// (whatever the time), wheels remember nothing and no travel is counted. Throws
  /// std::runtime_error "mujoco: body 'NAME', world I, time T: ..., expected finite numbers" before
  /// anything is added; std::invalid_argument for another mjModel.
  void Apply(const mjModel* m, mjData* d);
  /// All wheels of all worlds in one batch of each model; the same forces, bit for bit.
  void Apply(const mjModel* m, std::span<mjData* const> worlds);

  /// Names of the bodies, in the order of the wheels.
  const std::vector<std::string>& names() const { return names_; }
  /// Of the last Apply, world by world.
  std::span<const WheelForce> forces() const { return forces_; }
  const mjModel* model() const { return model_; }
  static int UserData(std::size_t wheels) { return 1 + 3 * static_cast<int>(wheels); }

 private:
  struct Wheel {
    int body, joint;
    std::size_t kind;
  };
  struct Kind {
    WheelContact contact;
    double radius, width;
    bool hard;
    // Of one Apply: the wheels of this kind and where they stand in forces_.
    std::vector<WheelMotion> motions;
    std::vector<ContactState> states;
    std::vector<WheelForce> out;
    std::vector<std::size_t> at;
  };
  void AddWheel(const mjModel* m, int body, std::size_t kind);
  WheelMotion MotionOf(const mjModel* m, const mjData* d, const Wheel& wheel) const;
  void PutGround(const mjModel* m, const mjData* d, const Kind& kind, WheelMotion* motion) const;
  void Check(std::span<mjData* const> worlds) const;

  const mjModel* model_;
  int ground_, offset_;
  std::vector<Kind> kinds_;
  std::vector<Wheel> wheels_;
  std::vector<std::string> names_;
  std::vector<WheelForce> forces_;
};

/// While it lives, MuJoCo asks `contact` for passive forces (mjcb_passive, after the one that was
/// installed before) in every mj_forward and mj_step of its model, in this one thread. What Apply
/// throws becomes an mju_error. Throws std::logic_error where another one lives.
class PassiveForces {
 public:
  explicit PassiveForces(SoilContact* contact);
  ~PassiveForces();
  PassiveForces(const PassiveForces&) = delete;
  PassiveForces& operator=(const PassiveForces&) = delete;
};

}  // namespace grouser::mujoco
