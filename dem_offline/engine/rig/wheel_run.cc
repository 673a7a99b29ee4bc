#include "dem_offline/engine/rig/wheel_run.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/report.h"
#include "dem_offline/engine/rig/scaling.h"

namespace grouser::dem {
namespace {

// Times over sqrt(d/g) and a speed over sqrt(g d): tests that are similar run similarly.
constexpr double kSetDownSpeed = 0.17;   // of the descending hub
constexpr double kFeltTime = 1.0 / 15;   // over which the load is smoothed while it descends
constexpr double kDamperTime = 1.0 / 3;  // of the damper while it settles
constexpr double kSettleTime = 4;        // at rest under load before driving
constexpr double kRampTime = 10.0 / 3;   // from rest to full speed
constexpr double kSampleTime = 1.0 / 30;
constexpr double kFirstCheck = 40.0 / 3;  // the first look at the stopping rule
constexpr double kCheckTime = 10.0 / 3;   // between looks
constexpr double kStressChunk = 5.0 / 3;  // of recorded stresses
constexpr double kOverloadTime = 1;       // beyond the most sinkage, until a run is an overload
constexpr double kBehindShare = 1.0;      // of the radius: a free wheel drawn back so far is lost
constexpr double kRunaway = 10;           // and one whose hub is so many times faster than its rim

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

WheelDrive DriveOf(const WheelTestSpec& spec, const Motion& target, double beta, double yaw,
                   double dt, double surface_m) {
  WheelDrive d = {};
  d.mode = spec.state.mode;
  d.dt_s = dt;
  d.load_n = spec.state.load_n;
  d.drawbar_n = spec.state.drawbar_n;
  d.mass_kg = spec.state.load_n / spec.soil.gravity_m_per_s2;
  d.inertia_kg_m2 = 0.5 * d.mass_kg * spec.wheel.radius_m * spec.wheel.radius_m;
  d.radius_m = spec.wheel.radius_m;
  d.width_m = spec.wheel.width_m;
  d.cos_yaw = std::cos(yaw);
  d.sin_yaw = std::sin(yaw);
  d.cos_beta = std::abs(std::cos(beta));
  d.sin_beta = std::abs(std::sin(beta));
  d.travel_m_per_s = std::hypot(target.v_x, target.v_y);
  d.rim_m_per_s = target.rim;
  const double unit = GravityTime(spec.soil);
  d.set_down_m_per_s = kSetDownSpeed * GravitySpeed(spec.soil);
  d.felt_s = kFeltTime * unit;
  d.damper_s = kDamperTime * unit;
  d.settle_s = kSettleTime * unit;
  d.ramp_s = kRampTime * unit;
  d.sample_s = kSampleTime * unit;
  d.first_check_s = kFirstCheck * unit;
  d.check_s = kCheckTime * unit;
  d.chunk_s = kStressChunk * unit;
  d.surface_m = surface_m;
  d.most_sinkage_m = MostSinkage(spec);
  d.deepest_m = d.most_sinkage_m + LargestDiameter(spec.soil);
  d.overload_s = kOverloadTime * unit;
  d.most_time_s = DriveTime(spec);
  d.most_behind_m = kBehindShare * spec.wheel.radius_m;
  d.most_hub_m_per_s = kRunaway * spec.rig.speed_m_per_s;
  d.most_lift_m = 2 * LargestDiameter(spec.soil);
  return d;
}

}  // namespace

double LongestRun(const WheelTestSpec& spec) {
  const double descent = MostSinkage(spec) + 2 * LargestDiameter(spec.soil);
  return descent / (kSetDownSpeed * GravitySpeed(spec.soil)) +
         kSettleTime * GravityTime(spec.soil) + DriveTime(spec);
}

double RecordBytes(const WheelTestSpec& spec) {
  constexpr double kSampleBytes = 2 * 8 * (kSampleChannels + 3),
                   kBinBytes = 3 * 8;  // vectors double
  const double bins = 2 * M_PI / spec.rig.stress_bin_rad * spec.rig.width_bins;
  const double time = DriveTime(spec) / GravityTime(spec.soil);
  return kSampleBytes * time / kSampleTime + kBinBytes * bins * time / kStressChunk;
}

WheelRun::WheelRun(const WheelTestSpec& spec, const Tile& tile)
    : spec_(spec), tile_(tile), recorder_(spec.wheel, spec.rig, YawOf(spec)) {
  out_.rayleigh_time_s = RayleighTime(SmallestRadius(spec.soil), spec.soil.density_kg_per_m3,
                                      spec.soil.youngs_modulus_pa, spec.soil.poisson_ratio);
  out_.dt_s = ExperimentStep(spec);
  beta_ = spec.state.mode == RigMode::kFreeSlip ? 0.0 : spec.state.attack_angle_rad;
  // The bed's x axis is the direction of travel: the wheel is turned in it.
  const double yaw = YawOf(spec);
  scene_ = std::make_unique<RigScene>(spec, tile, out_.dt_s);
  world().AddBody(WheelBody(spec, scene_->start_x_m(), yaw));
  target_ = TargetOf(spec, beta_);
  drive_ = DriveOf(spec, target_, beta_, yaw, out_.dt_s, tile.surface_m);
}

Body& WheelRun::wheel() { return world().body(kWheelBody); }

const char* WheelRun::Stage() const {
  return state_.stage == WheelStage::kDrive ? "drive" : "set down";
}

double WheelRun::Fraction() const {
  return std::clamp(state_.time_s / drive_.most_time_s, 0.0, 1.0);
}

bool WheelRun::Fail(const std::string& reason, StopCause cause) {
  out_.status = RunStatus::kFailed;
  out_.reason = reason;
  out_.stopped = cause;
  driven_ = false;
  return false;
}

bool WheelRun::Overload() {
  out_.status = RunStatus::kOverload;
  out_.stopped = StopCause::kOverload;
  out_.reason = "sinkage beyond " + Short(drive_.most_sinkage_m) + " m, " +
                Short(drive_.most_sinkage_m / drive_.radius_m) + " of the radius";
  return false;
}

bool WheelRun::Lost(StopCause cause) {
  out_.status = RunStatus::kLost;
  out_.stopped = cause;
  out_.reason = "drawbar of " + std::to_string(spec_.state.drawbar_n) + " N, which the wheel ";
  out_.reason += state_.behind_m > 0 || GoesBackwards() ? "cannot pull: the hub goes backwards"
                                                        : "cannot hold: the hub runs away";
  return false;
}

bool WheelRun::Stop(StopCause cause) {
  out_.stopped = cause;
  driven_ = true;
  return false;
}

void WheelRun::Take(const WheelSample& sample) {
  Series& s = out_.series;
  std::vector<double>* columns[kSampleChannels] = {
      &s.f_x_n,   &s.f_y_n,     &s.f_z_n,       &s.torque_n_m,
      &s.m_z_n_m, &s.sinkage_m, &s.v_x_m_per_s, &s.rim_speed_m_per_s};
  for (int k = 0; k < kSampleChannels; ++k) columns[k]->push_back(sample.mean[k]);
  s.time_s.push_back(sample.time_s);
  s.travel_m.push_back(sample.travel_m);
  s.hub_travel_m.push_back(sample.hub_travel_m);
}

bool WheelRun::Take(std::int32_t events) {
  if (events & kDriveBegins) {
    world().SetEnergy(true);
    balance_0_ = world().Balance();
  }
  if (events & kChunkEnds) recorder_.NextChunk(state_.time_s);
  if (events & kLedgerOpens) balance_0_ = world().Balance();
  if (events & kSampled) Take(state_.sample);
  if (events & kOverloaded) return Overload();
  if (events & kLifted) return Fail("the wheel left the ground");
  if (events & kOutOfHand) return Lost(StopCause::kLost);
  if ((events & kCheckDue) && FarEnough() && LookSteady().Enough()) {
    return Stop(StopCause::kPrecise);
  }
  if (events & kOutOfBed) return Stop(StopCause::kBedEnd);
  if (events & kTimeIsUp) return Stop(StopCause::kTimeUp);
  return true;
}

/// A hub that is held on the spot has no way to go.
bool WheelRun::FarEnough() const {
  const bool stands = spec_.state.mode == RigMode::kRimSpeed && drive_.travel_m_per_s == 0;
  return stands || state_.axle_path_m >= TravelOf(spec_).least_hub_m;
}

const SteadyWindow& WheelRun::LookSteady() {
  const auto ramp =
      std::lower_bound(out_.series.time_s.begin(), out_.series.time_s.end(), drive_.ramp_s) -
      out_.series.time_s.begin();
  window_ = FindSteady(out_.series, static_cast<std::size_t>(ramp), RuleOf(spec_));
  return window_;
}

/// The hub of a free wheel, in the mean over the window.
bool WheelRun::GoesBackwards() const {
  const auto& v = out_.series.v_x_m_per_s;
  return spec_.state.mode == RigMode::kFreeSlip && window_.last > window_.first &&
         std::accumulate(v.begin() + static_cast<std::ptrdiff_t>(window_.first),
                         v.begin() + static_cast<std::ptrdiff_t>(window_.last), 0.0) <= 0;
}

void WheelRun::Judge() {
  LookSteady();
  if (GoesBackwards()) {
    Lost(out_.stopped);
    return;
  }
  out_.status = window_.Steady() ? RunStatus::kSteady : RunStatus::kUnsteady;
  out_.means_of_no_state =
      window_.speed_drifts || !window_.unbalanced.empty() || !window_.uncertain.empty();
  if (!window_.travelled) {
    out_.reason = "less than one contact length travelled in the steady window";
  } else if (!window_.drift_free) {
    out_.reason = window_.drifting + " still drifts";
  } else if (!window_.unbalanced.empty()) {
    out_.reason = window_.unbalanced + " is out of balance: the wheel accelerates";
  } else if (!window_.uncertain.empty()) {
    out_.reason = "the standard error of " + window_.uncertain + " is above 10 % of its scale";
  } else if (!window_.precise) {
    out_.reason = "standard error above the target of the stopping rule";
  }
}

WheelTestResult WheelRun::Finish(std::uint64_t steps) {
  if (driven_) Judge();
  if (out_.series.time_s.size() >= 2 * kBlocks && window_.last == 0) LookSteady();
  FillMeans(spec_, window_, target_, beta_, out_);
  out_.hub_travel_m = state_.axle_path_m;
  FillEqualTravel(TravelOf(spec_), target_, out_);
  out_.energy.input_j = state_.input_j;
  FillEnergy(balance_0_, world().Balance(), out_.energy);
  const double error = EnergyError(out_.energy);
  const bool ran = out_.status == RunStatus::kSteady || out_.status == RunStatus::kUnsteady;
  if (ran && !(error <= kLargestEnergyError)) {
    Fail("energy: " + std::to_string(100 * error) +
         " % of it is unaccounted for, expected at most 2 %: the time step is too long");
  }
  out_.steps = steps;
  out_.use = scene_->use();
  out_.stress = recorder_.Average(out_.window_start_s, out_.window_end_s);
  out_.surface =
      MeasureSurface(world(), wheel().position_m, YawOf(spec_), LargestDiameter(spec_.soil));
  for (double& h : out_.surface.height_m) h -= tile_.surface_m;
  FillBedAndRules(spec_, tile_, world(), out_);
  FillSceneRules(spec_, *scene_, out_);
  return std::move(out_);
}

}  // namespace grouser::dem
