#pragma once

#include <vector>

#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {

/// Collects rim stresses in chunks of time, so that the steady window may be
/// chosen afterwards.
class StressRecorder {
 public:
  StressRecorder(const WheelShape& wheel, const RigSettings& rig);
  /// A contact of the wheel; yaw: of its x axis from the world's.
  void Add(const BodyContact& contact, double yaw_rad);
  /// One more sampled step of the present chunk.
  void CountStep() { ++chunks_.back().steps; }
  void NextChunk(double time_s);
  /// Mean over the chunks that began in [from_s, to_s). Entry and exit: the
  /// outermost bins in one piece with the loaded bottom whose width-mean
  /// normal stress exceeds 5 % of the largest.
  StressProfile Average(double from_s, double to_s) const;

 private:
  struct Chunk {
    double time_s = 0;
    long steps = 0;
    std::vector<double> normal, tangential, axial;  // sums of forces [N]
  };
  WheelShape wheel_;
  int angles_, widths_;
  double step_rad_;
  std::vector<Chunk> chunks_;
};

/// Top of the grains on a wheel-centred grid of one diameter, contact frame.
SurfaceProfile MeasureSurface(const World& world, const Vec3d& centre_m, double yaw_rad,
                              double step_m);

}  // namespace grouser::dem
