// One wheel test: set down, accelerate, hold until steady, report.
#include "dem_offline/engine/rig/wheel_test.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include "dem_offline/engine/rig/kinematics.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/recorder.h"
#include "dem_offline/engine/rig/report.h"
#include "dem_offline/engine/rig/scaling.h"
#include "dem_offline/engine/rig/scene.h"
#include "dem_offline/engine/rig/steady.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
namespace {

constexpr double kSetDownSpeed = 0.05;  // [m/s] of the descending hub
constexpr double kSettleTime = 0.12;    // [s] at rest under load before driving
constexpr double kRampTime = 0.1;       // [s] from rest to full speed
constexpr double kSampleTime = 1e-3;    // [s]
constexpr double kChunkTime = 0.05;     // [s] of the stress recorder
constexpr double kCheckTime = 0.1;      // [s] between looks at the stopping rule
constexpr int kStressStride = 10;       // steps between recorded stresses
constexpr double kOverloadShare = 0.7;  // of the radius

Body WheelBody(const WheelTestSpec& spec, double x_m, double yaw_rad) {
  Body w;
  w.shape = spec.wheel.treads.empty()
                ? SmoothWheel(spec.wheel.radius_m, spec.wheel.width_m)
                : TreadedWheel(spec.wheel.radius_m, spec.wheel.width_m, spec.wheel.treads);
  w.material = kWheelMaterial;
  w.motion = BodyMotion::kPrescribed;
  w.position_m = {x_m, 0.5 * spec.rig.bed_width_m,
                  HalfExtents(spec.wheel, 0)[2] + 0.1 * LargestDiameter(spec.soil)};
  w.orientation = {std::cos(0.5 * yaw_rad), 0, 0, std::sin(0.5 * yaw_rad)};
  return w;
}

Motion TargetOf(const WheelTestSpec& spec, double beta) {
  const double speed = spec.rig.speed_m_per_s;
  switch (spec.state.mode) {
    case RigMode::kTowed:
      return {speed * std::cos(beta), speed * std::sin(beta), 0};
    case RigMode::kFreeSlip:
      return {0, 0, speed};
    case RigMode::kRimSpeed:
      break;
  }
  return MotionAt(spec.state.slip, beta, speed);
}

double StepOf(const WheelTestSpec& spec, double rayleigh_time_s) {
  if (!spec.rig.scene.largest_step) return spec.rig.rayleigh_fraction * rayleigh_time_s;
  return LargestStep(spec.soil, spec.wheel,
                     LoadedOverlap(spec.soil, spec.wheel, spec.state.load_n));
}

class WheelTest {
 public:
  WheelTest(const WheelTestSpec& spec, const Tile& tile, const ProgressFn& progress)
      : spec_(spec), tile_(tile), progress_(progress), recorder_(spec.wheel, spec.rig) {
    out_.rayleigh_time_s = RayleighTime(SmallestRadius(spec.soil), spec.soil.density_kg_per_m3,
                                        spec.soil.youngs_modulus_pa, spec.soil.poisson_ratio);
    out_.dt_s = dt_ = StepOf(spec, out_.rayleigh_time_s);
    mass_ = spec.state.load_n / spec.soil.gravity_m_per_s2;
    inertia_ = 0.5 * mass_ * spec.wheel.radius_m * spec.wheel.radius_m;
    beta_ = spec.state.mode == RigMode::kFreeSlip ? 0.0 : spec.state.attack_angle_rad;
    // The bed's x axis is the direction of travel: the wheel is turned in it.
    yaw_ = YawOf(spec);
    scene_ = std::make_unique<RigScene>(spec, tile, dt_);
    world_ = &scene_->world();
    PlaceWheel();
  }

  WheelTestResult Run() {
    const auto begin = std::chrono::steady_clock::now();
    const bool driven = SetDown() && Drive();
    if (driven) Judge();
    Summarise();
    out_.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return std::move(out_);
  }

 private:
  Body& wheel() { return world_->body(kWheelBody); }
  const Wrench& wrench() { return world_->wrench(kWheelBody); }
  double& v_x() { return wheel().velocity_m_per_s[0]; }
  double& v_y() { return wheel().velocity_m_per_s[1]; }
  double& v_z() { return wheel().velocity_m_per_s[2]; }
  double Sinkage() { return spec_.wheel.radius_m - wheel().position_m[2]; }
  /// About the wheel's own axle.
  void Spin(double rad_per_s) {
    spin_ = rad_per_s;
    wheel().spin_rad_per_s = {-std::sin(yaw_) * spin_, std::cos(yaw_) * spin_, 0};
  }

  void PlaceWheel() {
    world_->AddBody(WheelBody(spec_, scene_->start_x_m(), yaw_));
    world_->RecordContacts([this](const BodyContact& c) {
      if (recording_ && c.body == kWheelBody) recorder_.Add(c, yaw_);
    });
    target_ = TargetOf(spec_, beta_);
    travel_speed_ = std::hypot(target_.v_x, target_.v_y);
  }

  bool Fail(const std::string& reason, StopCause cause = StopCause::kFault) {
    out_.status = RunStatus::kFailed;
    out_.reason = reason;
    out_.stopped = cause;
    return false;
  }

  /// One step of world and wheel; false ends the run.
  bool Advance() {
    scene_->Follow(steps_, wheel().position_m);
    const StepFault fault = world_->Step();
    ++steps_;
    if (fault != StepFault::kNone) return Fail(Explain(fault));
    if (steps_ % 500 == 0 && progress_) {
      const double share = std::clamp(time_ / spec_.rig.max_time_s, 0.0, 1.0);
      if (!progress_(share, stage_)) {
        return Fail("stopped by caller", StopCause::kCaller);
      }
    }
    return true;
  }

  /// Vertical motion under the constant load, with an optional damper.
  void FreeVertical(double damping_time) {
    const double damper = damping_time > 0 ? v_z() / damping_time : 0.0;
    v_z() += dt_ * ((wrench().fz - spec_.state.load_n) / mass_ - damper);
  }

  bool SetDown() {
    stage_ = "set down";
    double felt = 0;  // smoothed over 2 ms
    while (felt < 0.5 * spec_.state.load_n) {
      v_z() = -kSetDownSpeed;
      if (!Advance()) return false;
      felt += dt_ / 2e-3 * (wrench().fz - felt);
      if (Sinkage() > kOverloadShare * spec_.wheel.radius_m) return Overload();
    }
    for (double t = 0; t < kSettleTime; t += dt_) {
      FreeVertical(0.01);
      if (!Advance()) return false;
      if (Sinkage() > kOverloadShare * spec_.wheel.radius_m) return Overload();
    }
    return true;
  }

  bool Overload() {
    out_.status = RunStatus::kOverload;
    out_.stopped = StopCause::kOverload;
    out_.reason = "sinkage beyond 0.7 of the radius";
    return false;
  }

  void Steer(double share) {  // share of full speed, 0..1
    const Vec3Double v = HubVelocity(share);
    v_x() = v.x;
    v_y() = v.y;
    if (spec_.state.mode == RigMode::kTowed) {
      Spin(spin_ + dt_ * ContactMoment() / inertia_);
    } else {
      Spin(share * target_.rim / spec_.wheel.radius_m);
    }
  }

  struct Vec3Double {
    double x, y;
  };
  Vec3Double HubVelocity(double share) {
    if (spec_.state.mode != RigMode::kFreeSlip) return {share * travel_speed_, 0};
    const double pull = wrench().fx - spec_.state.drawbar_n * share;
    return {v_x() + dt_ * pull / mass_, 0};
  }
  /// Moment of the soil about the wheel's own axle.
  double ContactMoment() {
    const double c = std::cos(yaw_), s = std::sin(yaw_);
    return -s * wrench().tx + c * wrench().ty;
  }

  bool Drive() {
    stage_ = "drive";
    world_->SetEnergy(true);
    OpenLedger();
    const double front = std::sqrt(std::max(0.0, Sinkage() * (2 * spec_.wheel.radius_m)));
    double next_check = 0.4, next_chunk = 0;
    drive_start_ = 0;
    while (time_ < spec_.rig.max_time_s) {
      const double share = time_ < kRampTime ? 0.5 - 0.5 * std::cos(M_PI * time_ / kRampTime) : 1.0;
      Steer(share);
      FreeVertical(0.0);
      if (time_ >= next_chunk) {
        recorder_.NextChunk(time_);
        next_chunk += kChunkTime;
      }
      recording_ = steps_ % kStressStride == 0;
      if (recording_) recorder_.CountStep();
      if (!Advance()) return false;
      recording_ = false;
      time_ += dt_;
      Account();
      if (Sinkage() > kOverloadShare * spec_.wheel.radius_m) return Overload();
      if (Sinkage() < -2 * LargestDiameter(spec_.soil)) return Fail("the wheel left the ground");
      if (time_ >= next_check) {
        next_check += kCheckTime;
        if (LookSteady().Enough()) return Stop(StopCause::kPrecise);
      }
      if (OutOfBed(front)) return Stop(StopCause::kBedEnd);
    }
    return Stop(StopCause::kTimeUp);
  }
  bool Stop(StopCause cause) {
    out_.stopped = cause;
    return true;
  }

  /// The front of the wheel comes to ground that its start has disturbed, or
  /// its back to the edge of the window.
  bool OutOfBed(double front) {
    const double chord = std::max(front, ChordHalf());
    const double along =
        std::abs(std::cos(beta_)) * chord + 0.5 * std::abs(std::sin(beta_)) * spec_.wheel.width_m;
    return scene_->OutOfBed(wheel().position_m[0], axle_path_, along);
  }
  double ChordHalf() {
    const double z = std::clamp(Sinkage(), 0.0, spec_.wheel.radius_m);
    return std::sqrt(std::max(0.0, z * (2 * spec_.wheel.radius_m - z)));
  }

  void OpenLedger() {
    balance_0_ = world_->Balance();
    first_energy_ = true;
  }

  /// Work, paths and samples of the step just done.
  void Account() {
    const Wrench& f = wrench();
    const double moment = ContactMoment();
    if (first_energy_) {  // stored energy is known from the first counted step on
      balance_0_ = world_->Balance();
      first_energy_ = false;
    } else {
      out_.energy.input_j -= dt_ * (f.fx * v_x() + f.fy * v_y() + f.fz * v_z() + moment * spin_);
    }
    const double hub = std::hypot(v_x(), v_y());
    axle_path_ += hub * dt_;
    rim_path_ += std::abs(spin_) * spec_.wheel.radius_m * dt_;
    const double c = std::cos(yaw_), s = std::sin(yaw_);
    sum_[0] += c * f.fx + s * f.fy;
    sum_[1] += -s * f.fx + c * f.fy;
    sum_[2] += f.fz;
    sum_[3] += -moment;
    sum_[4] += f.tz;
    sum_[5] += Sinkage();
    sum_[6] += c * v_x() + s * v_y();
    sum_[7] += spin_ * spec_.wheel.radius_m;
    if (++summed_ * dt_ >= kSampleTime) Sample();
  }

  void Sample() {
    Series& s = out_.series;
    std::vector<double>* columns[] = {
        &s.f_x_n,   &s.f_y_n,     &s.f_z_n,       &s.torque_n_m,
        &s.m_z_n_m, &s.sinkage_m, &s.v_x_m_per_s, &s.rim_speed_m_per_s};
    for (int k = 0; k < 8; ++k) {
      columns[k]->push_back(sum_[k] / static_cast<double>(summed_));
      sum_[k] = 0;
    }
    s.time_s.push_back(time_);
    s.travel_m.push_back(std::max(axle_path_, rim_path_));
    summed_ = 0;
  }

  const SteadyWindow& LookSteady() {
    const auto ramp =
        std::lower_bound(out_.series.time_s.begin(), out_.series.time_s.end(), kRampTime) -
        out_.series.time_s.begin();
    window_ = FindSteady(out_.series, static_cast<std::size_t>(ramp), spec_.state.load_n,
                         spec_.wheel.radius_m, spec_.rig.target_relative_error);
    return window_;
  }

  void Judge() {
    LookSteady();
    if (!window_.travelled) {
      out_.status = RunStatus::kUnsteady;
      out_.reason = "less than one contact length travelled in the steady window";
    } else if (!window_.drift_free) {
      out_.status = RunStatus::kUnsteady;
      out_.reason = window_.drifting + " still drifts";
    } else {
      out_.status = RunStatus::kSteady;
      if (!window_.precise) out_.reason = "standard error above the target of the stopping rule";
    }
  }

  void Summarise() {
    if (out_.series.time_s.size() >= 2 * kBlocks && window_.last == 0) LookSteady();
    FillMeans(spec_, window_, target_, beta_, out_);
    FillEnergy(balance_0_, world_->Balance(), out_.energy);
    const double error = EnergyError(out_.energy);
    const bool ran = out_.status == RunStatus::kSteady || out_.status == RunStatus::kUnsteady;
    if (ran && !(error <= kLargestEnergyError)) {
      Fail("energy: " + std::to_string(100 * error) +
           " % of it is unaccounted for, expected at most 2 %: the time step is too long");
    }
    out_.steps = steps_;
    out_.use = scene_->use();
    out_.stress = recorder_.Average(out_.window_start_s, out_.window_end_s);
    out_.surface = MeasureSurface(*world_, wheel().position_m, yaw_, LargestDiameter(spec_.soil));
    FillBedAndRules(spec_, tile_, *world_, out_);
    FillSceneRules(spec_, *scene_, out_);
  }

  WheelTestSpec spec_;
  const Tile& tile_;
  ProgressFn progress_;
  StressRecorder recorder_;
  std::unique_ptr<RigScene> scene_;
  World* world_ = nullptr;
  WheelTestResult out_;
  SteadyWindow window_;
  Motion target_ = {};
  std::string stage_;
  double dt_ = 0, mass_ = 0, inertia_ = 0, beta_ = 0, travel_speed_ = 0;
  double yaw_ = 0, spin_ = 0;
  double time_ = 0, drive_start_ = 0, axle_path_ = 0, rim_path_ = 0;
  double sum_[8] = {};
  long summed_ = 0;
  std::uint64_t steps_ = 0;
  bool recording_ = false, first_energy_ = true;
  EnergyBalance balance_0_;
};

}  // namespace

WheelTestResult RunWheelTest(const WheelTestSpec& spec, const Tile& tile,
                             const ProgressFn& progress) {
  ValidateSpec(spec);
  return WheelTest(spec, tile, progress).Run();
}

}  // namespace grouser::dem
