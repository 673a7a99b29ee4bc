#pragma once

#include <cmath>
#include <cstdint>

#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/engine/world/rigid_body.h"

// What the rig does to its wheel before and after every step, and what it sums
// up: index bodies that all back ends share. The bed's x axis is the direction
// of travel; the wheel is turned in it by the yaw.

namespace grouser::dem {

/// A wheel test in plain numbers; constant.
struct WheelDrive {
  RigMode mode;
  double dt_s, load_n, drawbar_n, mass_kg, inertia_kg_m2;
  double radius_m, width_m, cos_yaw, sin_yaw;
  double cos_beta, sin_beta;           ///< of the attack angle, absolute
  double travel_m_per_s, rim_m_per_s;  ///< at full speed
  double set_down_m_per_s, settle_s, ramp_s, sample_s, first_check_s, check_s, chunk_s;
  double felt_s, damper_s;  ///< while set down: time of the smoothed load, of the damper
  double surface_m;         ///< the undisturbed plane, Tile::surface_m
  /// Sinkage beyond most_sinkage_m for overload_s, or at all beyond deepest_m, ends a run.
  double most_sinkage_m, deepest_m, overload_s, most_lift_m, most_time_s;
  double most_behind_m, most_hub_m_per_s;  ///< kFreeSlip: beyond them the wheel is lost
};

/// Where a run has no ground left: its own start, or the edge of its window.
struct BedLimit {
  bool window;
  double back_edge_m;     ///< window: of what may be worked on
  double longest_path_m;  ///< else: of the hub, less the wheel's own length
};

enum class WheelStage : std::int32_t { kDescend, kSettle, kDrive };

/// What a step calls for; several at once. From kOverloaded on they end the run.
enum WheelEvent : std::int32_t {
  kDriveBegins = 1,  ///< the energy is booked from here on
  kLedgerOpens = 2,  ///< the stored energy is known
  kSampled = 4,      ///< `sample` is complete
  kCheckDue = 8,     ///< look at the stopping rule
  kChunkEnds = 16,   ///< of recorded stresses; a new one begins
  kOverloaded = 32,
  kLifted = 64,
  kOutOfBed = 128,
  kTimeIsUp = 256,
  kOutOfHand = 512,  ///< kFreeSlip: the drawbar moves the hub, not the wheel
};

inline constexpr int kSampleChannels = 8;
/// Means over sample_s: F_x, F_y, F_z, torque, M_z (contact frame), sinkage, v_x,
/// rim speed.
struct WheelSample {
  double time_s, travel_m, hub_travel_m, mean[kSampleChannels];
};

struct WheelState {
  WheelStage stage = WheelStage::kDescend;
  bool ledger_open = false;
  double felt_n = 0;  ///< smoothed load while it descends
  double settled_s = 0, time_s = 0, next_check_s = 0, next_chunk_s = 0;
  double spin_rad_per_s = 0;  ///< about its own axle
  double axle_path_m = 0, rim_path_m = 0;
  double deep_s = 0;    ///< how long the sinkage has been beyond most_sinkage_m
  double behind_m = 0;  ///< of the hub from the foremost place it came to
  double front_m = 0;   ///< of the wheel from its hub when the drive began
  double input_j = 0;
  double sum[kSampleChannels] = {};
  std::int64_t summed = 0;
  WheelSample sample = {};
};

namespace wheel_step {

/// Of the lowest point of the rim under the undisturbed plane.
GROUSER_HD double Sinkage(const WheelDrive& d, const RigidBody& wheel) {
  return d.radius_m - wheel.position_m[2] + d.surface_m;
}
/// Not at one instant: a wheel that has just been locked or set down swings through its mean.
GROUSER_HD bool Overloaded(const WheelDrive& d, const RigidBody& wheel, WheelState* s) {
  const double z = Sinkage(d, wheel);
  s->deep_s = z > d.most_sinkage_m ? s->deep_s + d.dt_s : 0;
  return s->deep_s > d.overload_s || z > d.deepest_m;
}
/// Moment of the soil about the wheel's own axle.
GROUSER_HD double AxleMoment(const WheelDrive& d, const Wrench& f) {
  return -d.sin_yaw * f.tx + d.cos_yaw * f.ty;
}
GROUSER_HD void Spin(const WheelDrive& d, double rad_per_s, WheelState* s, RigidBody* wheel) {
  s->spin_rad_per_s = rad_per_s;
  wheel->spin_rad_per_s = {-d.sin_yaw * rad_per_s, d.cos_yaw * rad_per_s, 0};
}

/// Vertical motion under the constant load; damping_s: time of a damper, 0: none.
GROUSER_HD void FreeVertical(const WheelDrive& d, const Wrench& f, double damping_s,
                             RigidBody* wheel) {
  double& v_z = wheel->velocity_m_per_s[2];
  const double damper = damping_s > 0 ? v_z / damping_s : 0.0;
  v_z += d.dt_s * ((f.fz - d.load_n) / d.mass_kg - damper);
}

/// share: of full speed, 0 to 1.
GROUSER_HD void Steer(const WheelDrive& d, const Wrench& f, double share, WheelState* s,
                      RigidBody* wheel) {
  Vec3d& v = wheel->velocity_m_per_s;
  if (d.mode == RigMode::kFreeSlip) {
    const double pull = f.fx - d.drawbar_n * share;
    v[0] = v[0] + d.dt_s * pull / d.mass_kg;
  } else {
    v[0] = share * d.travel_m_per_s;
  }
  v[1] = 0;
  if (d.mode == RigMode::kTowed) {
    Spin(d, s->spin_rad_per_s + d.dt_s * AxleMoment(d, f) / d.inertia_kg_m2, s, wheel);
  } else {
    Spin(d, share * d.rim_m_per_s / d.radius_m, s, wheel);
  }
}

/// Paths, work and sums of the step just done; the events it brings.
GROUSER_HD std::int32_t Account(const WheelDrive& d, const RigidBody& wheel, const Wrench& f,
                                WheelState* s) {
  std::int32_t events = 0;
  const Vec3d& v = wheel.velocity_m_per_s;
  const double moment = AxleMoment(d, f), spin = s->spin_rad_per_s;
  if (s->ledger_open) {
    s->input_j -= d.dt_s * (f.fx * v[0] + f.fy * v[1] + f.fz * v[2] + moment * spin);
  } else {
    s->ledger_open = true;
    events |= kLedgerOpens;
  }
  const double rim = spin < 0 ? -spin : spin;
  s->axle_path_m += std::sqrt(v[0] * v[0] + v[1] * v[1]) * d.dt_s;
  s->rim_path_m += rim * d.radius_m * d.dt_s;
  const double c = d.cos_yaw, n = d.sin_yaw;
  const double now[kSampleChannels] = {
      c * f.fx + n * f.fy, -n * f.fx + c * f.fy, f.fz, -moment, f.tz, Sinkage(d, wheel),
      c * v[0] + n * v[1], spin * d.radius_m};
  for (int k = 0; k < kSampleChannels; ++k) s->sum[k] += now[k];
  if (static_cast<double>(++s->summed) * d.dt_s < d.sample_s) return events;
  s->sample.time_s = s->time_s;
  s->sample.hub_travel_m = s->axle_path_m;
  s->sample.travel_m = s->axle_path_m > s->rim_path_m ? s->axle_path_m : s->rim_path_m;
  for (int k = 0; k < kSampleChannels; ++k) {
    s->sample.mean[k] = s->sum[k] / static_cast<double>(s->summed);
    s->sum[k] = 0;
  }
  s->summed = 0;
  return events | kSampled;
}

/// Half of the chord that the undisturbed plane cuts off the wheel.
GROUSER_HD double ChordHalf(const WheelDrive& d, const RigidBody& wheel) {
  double z = Sinkage(d, wheel);
  z = z < 0 ? 0 : (z > d.radius_m ? d.radius_m : z);
  const double square = z * (2 * d.radius_m - z);
  return std::sqrt(square > 0 ? square : 0.0);
}

/// The front of the wheel comes to ground that its start has disturbed, or its
/// back to the edge of the window.
GROUSER_HD bool OutOfBed(const WheelDrive& d, const BedLimit& limit, const WheelState& s,
                         const RigidBody& wheel) {
  const double chord = ChordHalf(d, wheel);
  const double reach =
      d.cos_beta * (s.front_m > chord ? s.front_m : chord) + 0.5 * d.sin_beta * d.width_m;
  if (limit.window) return wheel.position_m[0] - reach < limit.back_edge_m;
  return s.axle_path_m > limit.longest_path_m - 2 * reach;
}

/// A free wheel that cannot hold its drawbar: drawn back, or pushed ahead (a drawbar
/// below 0) so much faster than its rim that it only slides.
GROUSER_HD bool OutOfHand(const WheelDrive& d, const RigidBody& wheel, WheelState* s) {
  if (d.mode != RigMode::kFreeSlip) return false;
  const double v = wheel.velocity_m_per_s[0];
  s->behind_m -= d.dt_s * v;
  if (s->behind_m < 0) s->behind_m = 0;
  return s->behind_m > d.most_behind_m || v > d.most_hub_m_per_s;
}

/// Velocities of the wheel for the step to come; f: the wrench of the last.
GROUSER_HD void Before(const WheelDrive& d, const Wrench& f, WheelState* s, RigidBody* wheel) {
  constexpr double kPi = 3.14159265358979323846;
  switch (s->stage) {
    case WheelStage::kDescend:
      wheel->velocity_m_per_s[2] = -d.set_down_m_per_s;
      return;
    case WheelStage::kSettle:
      FreeVertical(d, f, d.damper_s, wheel);
      return;
    case WheelStage::kDrive:
      break;
  }
  const double share = s->time_s < d.ramp_s ? 0.5 - 0.5 * cos(kPi * s->time_s / d.ramp_s) : 1.0;
  Steer(d, f, share, s, wheel);
  FreeVertical(d, f, 0.0, wheel);
}

/// After a step; f: its wrench. Returns WheelEvents.
GROUSER_HD std::int32_t After(const WheelDrive& d, const BedLimit& limit, const RigidBody& wheel,
                              const Wrench& f, WheelState* s) {
  std::int32_t events = Overloaded(d, wheel, s) ? kOverloaded : 0;
  switch (s->stage) {
    case WheelStage::kDescend:
      s->felt_n += d.dt_s / d.felt_s * (f.fz - s->felt_n);
      if (s->felt_n >= 0.5 * d.load_n) s->stage = WheelStage::kSettle;
      return events;
    case WheelStage::kSettle:
      s->settled_s += d.dt_s;
      if (s->settled_s < d.settle_s) return events;
      s->stage = WheelStage::kDrive;
      s->next_check_s = d.first_check_s;
      s->next_chunk_s = d.chunk_s;
      s->front_m = std::sqrt(Sinkage(d, wheel) > 0 ? Sinkage(d, wheel) * (2 * d.radius_m) : 0.0);
      return events | kDriveBegins | kChunkEnds;
    case WheelStage::kDrive:
      break;
  }
  s->time_s += d.dt_s;
  events |= Account(d, wheel, f, s);
  if (Sinkage(d, wheel) < -d.most_lift_m) events |= kLifted;
  if (OutOfHand(d, wheel, s)) events |= kOutOfHand;
  if (s->time_s >= s->next_check_s) {
    s->next_check_s += d.check_s;
    events |= kCheckDue;
  }
  if (s->time_s >= s->next_chunk_s) {
    s->next_chunk_s += d.chunk_s;
    events |= kChunkEnds;
  }
  if (OutOfBed(d, limit, *s, wheel)) events |= kOutOfBed;
  if (!(s->time_s < d.most_time_s)) events |= kTimeIsUp;
  return events;
}

}  // namespace wheel_step
}  // namespace grouser::dem
