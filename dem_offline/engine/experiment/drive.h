#pragma once

#include <functional>
#include <string>

#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/engine/experiment/freedoms.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem::experiment {

/// What a body's program may ask about the rest of the experiment.
struct Surroundings {
  double dt_s = 0;
  double gravity_m_per_s2 = 0;
  double unit_s = 0;  ///< sqrt(d/g): of the damper and of smoothed forces
  std::function<bool(const std::string& body)> done;
  std::function<double()> restlessness;  ///< kinetic energy over sum m g d
};

/// Moves one body of a world through its program. Velocities of a prescribed body are set before
/// every step, so that a displacement is exact where it has a closed form (shake), and a step that
/// ends by distance or angle ends there to rounding.
class Drive {
 public:
  /// most_s: of each step, in its order. mass: where a step leaves a degree of freedom.
  Drive(const BodySpec& spec, int body, const BuiltBody& built, std::vector<double> most_s,
        const FreeMass& mass, const Surroundings& around);

  /// Before a step, with the wrench of the last one.
  void Before(World& world);
  /// After it. False: an end that did not come within its time; `reason` says which.
  bool After(const World& world);

  bool done() const { return at_ >= spec_.motion.size(); }
  const std::string& reason() const { return reason_; }
  int body() const { return body_; }
  const std::string& name() const { return spec_.name; }
  /// All that changes, for checkpoints: whatever is added to the members below that a later step
  /// depends on belongs here.
  template <class Archive>
  void Walk(Archive& a) {
    a(at_), a(entered_), a(steps_), a(gone_m_), a(turned_step_), a(held_m_per_s_), a(felt_n_);
    a(speed_now_), a(spin_now_), a(freedoms_);
  }

 private:
  void Enter(World& world);
  double Share() const;
  Vec3d Swing(double t) const;
  bool Ended(const World& world);

  BodySpec spec_;
  int body_;
  /// From the origin of the file's body coordinates to the Body's, and the axle: in its axes.
  Vec3d centre_, axle_;
  std::vector<double> most_;
  FreeMass mass_;
  Freedoms freedoms_;
  Surroundings around_;
  std::size_t at_ = 0;
  bool entered_ = false;
  std::int64_t steps_ = 0;  ///< in this step of the program
  double gone_m_ = 0, turned_step_ = 0, held_m_per_s_ = 0, felt_n_ = 0;
  double speed_now_ = 0, spin_now_ = 0;
  std::string reason_;
};

}  // namespace grouser::dem::experiment
