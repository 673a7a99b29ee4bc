#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/isa/kernels.h"
#include "dem_offline/engine/rig/kinematics.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/scaling.h"
#include "dem_offline/engine/rig/scene.h"
#include "dem_offline/engine/rig/steady.h"
#include "dem_offline/engine/rig/wheel_run.h"

namespace grouser::dem {
namespace {

constexpr double kSidesAbove = 1.5;   // [radii] of sinkage up to which a wheel's sides hold soil
constexpr double kDepthShare = 0.75;  // of the bed's depth that a wheel may sink
constexpr double kGrainsUnder = 2;    // of the largest, between wheel and floor
constexpr double kSpareTime = 1.25;   // over what the hub takes for its way

void CheckScene(const SceneSettings& s) {
  if (s.bed != SceneBed::kWindow && s.window_length_m != 0) {
    throw SpecError("rig.scene.window_length_m", Short(s.window_length_m),
                    "0 unless rig.scene.bed is window");
  }
  CheckWithin("rig.scene.window_length_m", s.window_length_m, 0, 1e3);
  CheckWithin("rig.scene.window_ahead", s.window_ahead, 0.2, 0.8);
  CheckWithin("rig.scene.freeze_box", s.freeze_box, 1, 100);
  CheckWithin("rig.scene.freeze_speed", s.freeze_speed, 1e-6, 1);
  CheckWithin("rig.scene.look_steps", s.look_steps, 1, 10000);
}

void CheckRigNumbers(const RigSettings& r) {
  CheckPositive("rig.speed_m_per_s", r.speed_m_per_s);
  if (r.max_time_s != 0) CheckPositive("rig.max_time_s", r.max_time_s);
  CheckPositive("rig.target_relative_error", r.target_relative_error);
  CheckWithin("rig.target_relative_error", r.target_relative_error, 0, kLargestError);
  CheckWithin("rig.stress_bin_rad", r.stress_bin_rad, 0.01, 0.8);
  CheckWithin("rig.width_bins", r.width_bins, 1, 100);
  CheckWithin("rig.travel.least_hub_m", r.travel.least_hub_m, 0, 1e6);
  CheckWithin("rig.travel.compare_from_hub_m", r.travel.compare_from_hub_m, 0, 1e6);
  CheckWithin("rig.travel.compare_to_hub_m", r.travel.compare_to_hub_m, 0, 1e6);
  CheckScene(r.scene);
}

void CheckWheel(const WheelShape& w) {
  CheckPositive("wheel.radius_m", w.radius_m);
  CheckPositive("wheel.width_m", w.width_m);
  CheckWithin("wheel.restitution", w.restitution, 1e-3, 1);
  CheckWithin("wheel.friction", w.friction, 0, 10);
  CheckWithin("wheel.rolling_friction", w.rolling_friction, 0, 10);
  if (w.treads.empty()) return;
  try {
    TreadedWheel(w.radius_m, w.width_m, w.treads);
  } catch (const std::invalid_argument& error) {
    throw SpecError("wheel.treads", error.what(), "treads that stand on the wheel");
  }
}

/// A length that must be longer than what stands on it.
void CheckLonger(const char* field, double length_m, double least_m, const std::string& what) {
  if (length_m > least_m) return;
  throw SpecError(field, Short(length_m) + " m", "more than " + Short(least_m) + " m, " + what);
}

void CheckWheelOnBed(const WheelTestSpec& s) {
  const WheelShape& w = s.wheel;
  CheckLonger("rig.bed_length_m", s.rig.bed_length_m, 3 * std::max(w.radius_m, 0.5 * w.width_m),
              "1.5 wheel diameters");
  CheckWithin("rig.most_sinkage_m", s.rig.most_sinkage_m, 0,
              std::min(kSidesAbove * w.radius_m, s.rig.bed_depth_m - LargestDiameter(s.soil)));
  const TravelSettings travel = TravelOf(s);
  if (!(travel.compare_from_hub_m < travel.compare_to_hub_m)) {
    throw SpecError("rig.travel.compare_from_hub_m", Short(travel.compare_from_hub_m),
                    "less than rig.travel.compare_to_hub_m = " + Short(travel.compare_to_hub_m));
  }
  CheckLonger("rig.bed_width_m", s.rig.bed_width_m, 1.2 * w.width_m, "1.2 wheel widths");
}

/// Refuses what was given though nothing uses it: what is asked is never ignored.
void CheckUnused(const char* field, double value, const char* expected) {
  if (value != 0) throw SpecError(field, Short(value), expected);
}

void CheckMode(const TestState& s, double speed_m_per_s) {
  CheckPositive("state.load_n", s.load_n);
  if (!std::isfinite(s.drawbar_n)) {
    throw SpecError("state.drawbar_n", Short(s.drawbar_n), "a finite number");
  }
  CheckWithin("state.attack_angle_rad", s.attack_angle_rad, -M_PI, M_PI);
  if (s.mode == RigMode::kRimSpeed) {
    MotionAt(s.slip, s.attack_angle_rad, speed_m_per_s);
  } else {
    CheckUnused("state.slip", s.slip, "0 unless the mode is rim, which holds it");
  }
  if (s.mode == RigMode::kFreeSlip) {
    CheckUnused("state.attack_angle_rad", s.attack_angle_rad,
                "0 in mode free, whose hub moves along x alone");
  } else {
    CheckUnused("state.drawbar_n", s.drawbar_n, "0 unless the mode is free, which pulls it");
  }
}

/// What depends on the state: how the turned wheel fits, and how far it moves in a step.
void CheckState(const WheelTestSpec& spec) {
  CheckMode(spec.state, spec.rig.speed_m_per_s);
  const Vec3d half = HalfExtents(spec.wheel, YawOf(spec));
  CheckLonger("rig.bed_width_m", spec.rig.bed_width_m, 2 * half[1],
              "the wheel's extent across its path");
  const double window = spec.rig.scene.window_length_m;
  if (spec.rig.scene.bed == SceneBed::kWindow && window > 0 && !(window >= LeastWindow(spec))) {
    throw SpecError("rig.scene.window_length_m", Short(window) + " m",
                    "0 (by rule) or at least " + Short(LeastWindow(spec)) + " m");
  }
  const double far = spec.rig.speed_m_per_s * ExperimentStep(spec),
               most = 0.1 * SmallestRadius(spec.soil);
  if (!(far <= most)) {
    throw SpecError("rig.speed_m_per_s",
                    Short(spec.rig.speed_m_per_s) + " (" + Short(far) + " m in a time step)",
                    "at most " + Short(most) + " m in a step, a tenth of the smallest radius");
  }
}

}  // namespace

double MostSinkage(const WheelTestSpec& spec) {
  if (spec.rig.most_sinkage_m > 0) return spec.rig.most_sinkage_m;
  const double depth = spec.rig.bed_depth_m;
  return std::min({kSidesAbove * spec.wheel.radius_m, kDepthShare * depth,
                   depth - kGrainsUnder * LargestDiameter(spec.soil)});
}

TravelSettings TravelOf(const WheelTestSpec& spec) {
  TravelSettings t = spec.rig.travel;
  if (t.least_hub_m == 0) t.least_hub_m = spec.wheel.radius_m;
  if (t.compare_to_hub_m == 0) t.compare_to_hub_m = t.least_hub_m;
  if (t.compare_from_hub_m == 0) t.compare_from_hub_m = 2.0 / 3 * t.compare_to_hub_m;
  return t;
}

double DriveTime(const WheelTestSpec& spec) {
  if (spec.rig.max_time_s > 0) return spec.rig.max_time_s;
  const double speed = spec.rig.speed_m_per_s, least = 0.1 * speed;
  const TravelSettings t = TravelOf(spec);
  double hub = speed;
  if (spec.state.mode == RigMode::kRimSpeed) {
    const Motion m = MotionAt(spec.state.slip, spec.state.attack_angle_rad, speed);
    hub = std::hypot(m.v_x, m.v_y);
  }
  return kSpareTime * std::max(t.least_hub_m, t.compare_to_hub_m) / std::max(hub, least);
}

BedSpec BedOf(const WheelTestSpec& spec) {
  return {.soil = spec.soil,
          .length_m = spec.rig.bed_length_m,
          .width_m = spec.rig.bed_width_m,
          .depth_m = spec.rig.bed_depth_m,
          .rayleigh_fraction = spec.rig.rayleigh_fraction,
          .seed = spec.seed};
}

Work WorkOf(const WheelTestSpec& spec) {
  const BedSpec bed = BedOf(spec);
  const double tile = bed.soil.solid_fraction * bed.length_m * bed.width_m * bed.depth_m /
                      MeanGrainVolume(bed.soil);
  Work work;
  work.grains = tile * SceneLength(spec) / bed.length_m;
  work.steps = LongestRun(spec) / ExperimentStep(spec);
  work.bytes = kBytesPerGrain * (work.grains + tile) + RecordBytes(spec);
  return work;
}

void ValidateRig(const WheelTestSpec& spec, const WorkLimits& limits) {
  CheckRigNumbers(spec.rig);
  CheckWheel(spec.wheel);
  ValidateBed(BedOf(spec), limits);
  CheckWheelOnBed(spec);
}

void ValidateSpec(const WheelTestSpec& spec, const WorkLimits& limits) {
  ValidateRig(spec, limits);
  CheckState(spec);
  CheckWork("rig.max_time_s, rig.scene", WorkOf(spec), limits);
}

SceneSettings FullDomain() {
  SceneSettings s;
  s.bed = SceneBed::kFull;
  return s;
}

SceneSettings ReducedDomain() {
  SceneSettings s;
  s.bed = SceneBed::kWindow;
  s.freeze = true;
  s.freeze_box = 1.25;
  s.freeze_speed = 0.01;
  s.largest_step = true;
  return s;
}

const char* Explain(StopCause cause) {
  static constexpr const char* kWords[] = {
      // in the order of the causes
      "time is up", "precise enough",   "end of the bed", "overload", "the drawbar cannot be held",
      "fault",      "stopped by caller"};
  return kWords[static_cast<int>(cause)];
}

const char* NameOf(RunStatus status) {
  static constexpr const char* kNames[] = {"steady", "unsteady", "overload", "failed", "lost"};
  return kNames[static_cast<int>(status)];
}

const char* EngineVersion() { return "6"; }
const char* EngineIsa() { return BestIsa(); }

}  // namespace grouser::dem
