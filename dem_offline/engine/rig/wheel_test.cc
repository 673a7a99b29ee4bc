// One wheel test on the CPU: set down, accelerate, hold until steady, report.
#include "dem_offline/engine/rig/wheel_test.h"

#include <chrono>

#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/wheel_run.h"

namespace grouser::dem {
namespace {

/// Stresses of every so many steps of the drive.
class Recording {
 public:
  explicit Recording(WheelRun& run) : run_(run) {
    run.world().RecordContacts([this](const BodyContact& c) {
      if (on_ && c.body == kWheelBody) run_.recorder().Add(c);
    });
  }
  ~Recording() { run_.world().RecordContacts(nullptr); }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  void BeforeStep(std::uint64_t step) {
    on_ = run_.state().stage == WheelStage::kDrive && step % kStressStride == 0;
    if (on_) run_.recorder().CountStep();
  }

 private:
  WheelRun& run_;
  bool on_ = false;
};

bool OneStep(WheelRun& run, Recording& recording, std::uint64_t* steps,
             const ProgressFn& progress) {
  World& world = run.world();
  const auto poll = static_cast<std::uint64_t>(PollSteps(world.count()));
  wheel_step::Before(run.drive(), world.wrench(kWheelBody), &run.state(), &run.wheel());
  recording.BeforeStep(*steps);
  run.scene().Follow(*steps, run.wheel().position_m);
  const StepFault fault = world.Step();
  ++*steps;
  if (fault != StepFault::kNone) return run.Fail(Explain(fault));
  if (*steps % poll == 0 && progress && !progress(run.Fraction(), run.Stage())) {
    return run.Fail("stopped by caller", StopCause::kCaller);
  }
  return run.Take(wheel_step::After(run.drive(), run.Limit(), run.wheel(), world.wrench(kWheelBody),
                                    &run.state()));
}

}  // namespace

WheelTestResult RunWheelTest(const WheelTestSpec& spec, const Tile& tile,
                             const ProgressFn& progress, const WorkLimits& limits) {
  ValidateSpec(spec, limits);
  const auto begin = std::chrono::steady_clock::now();
  WheelRun run(spec, tile);
  std::uint64_t steps = 0;
  {
    Recording recording(run);
    while (OneStep(run, recording, &steps, progress)) {
    }
  }
  WheelTestResult out = run.Finish(steps);
  out.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return out;
}

}  // namespace grouser::dem
