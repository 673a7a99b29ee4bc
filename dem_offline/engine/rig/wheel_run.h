#pragma once

#include <memory>
#include <string>

#include "dem_offline/engine/rig/kinematics.h"
#include "dem_offline/engine/rig/recorder.h"
#include "dem_offline/engine/rig/scene.h"
#include "dem_offline/engine/rig/steady.h"
#include "dem_offline/engine/rig/wheel_step.h"
#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem {

/// One wheel test but for its steps, which a back end makes: the scene with its
/// wheel, what the events of a step call for, and the report.
class WheelRun {
 public:
  /// Throws std::invalid_argument when tile, rig and scene do not fit. The tile
  /// must outlive the run.
  WheelRun(const WheelTestSpec& spec, const Tile& tile);

  const WheelTestSpec& spec() const { return spec_; }
  RigScene& scene() { return *scene_; }
  World& world() { return scene_->world(); }
  Body& wheel();
  StressRecorder& recorder() { return recorder_; }
  const WheelDrive& drive() const { return drive_; }
  BedLimit Limit() const { return scene_->Limit(); }
  WheelState& state() { return state_; }
  const char* Stage() const;  ///< for people
  double Fraction() const;    ///< of the longest time [0, 1]

  /// After a step, its events; false ends the run. The world stands as after
  /// that step where an event asks for its energy (kLedgerOpens).
  bool Take(std::int32_t events);
  void Take(const WheelSample& sample);  ///< goes before the events of its step
  /// The step ended with a fault, or the caller had enough: always false.
  bool Fail(const std::string& reason, StopCause cause = StopCause::kFault);

  /// Judges and reports; once, with the world as it stands in the end.
  WheelTestResult Finish(std::uint64_t steps);

 private:
  bool Stop(StopCause cause);
  bool Overload();
  bool Lost(StopCause cause);
  bool GoesBackwards() const;
  bool FarEnough() const;
  const SteadyWindow& LookSteady();
  void Judge();

  WheelTestSpec spec_;
  const Tile& tile_;
  StressRecorder recorder_;
  std::unique_ptr<RigScene> scene_;
  WheelTestResult out_;
  SteadyWindow window_;
  Motion target_ = {};
  double beta_ = 0;
  WheelDrive drive_ = {};
  WheelState state_;
  bool driven_ = false;
  EnergyBalance balance_0_;
};

/// Steps between recorded stresses.
inline constexpr int kStressStride = 10;

/// Set down, settled and driven at the longest [s].
double LongestRun(const WheelTestSpec& spec);
/// Bytes of a run's samples and stresses at the longest.
double RecordBytes(const WheelTestSpec& spec);

}  // namespace grouser::dem
