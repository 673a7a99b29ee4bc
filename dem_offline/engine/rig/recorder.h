#pragma once

#include <vector>

#include "dem_offline/engine/rig/stress_bin.h"
#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {

/// Collects rim stresses in chunks of time, so that the steady window may be
/// chosen afterwards.
class StressRecorder {
 public:
  /// yaw: of the wheel's x axis from the world's.
  StressRecorder(const WheelShape& wheel, const RigSettings& rig, double yaw_rad);
  const StressGrid& grid() const { return grid_; }
  /// A contact of the wheel.
  void Add(const BodyContact& contact);
  /// What somebody else has summed over so many steps: [bins x 3] normal,
  /// tangential, axial.
  void AddSums(long steps, const std::vector<double>& sums);
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
    std::vector<double> sums;  // [bins x 3] of forces [N]
  };
  WheelShape wheel_;
  StressGrid grid_;
  std::vector<Chunk> chunks_;
};

/// Top of the grains on a wheel-centred grid of one diameter, contact frame.
SurfaceProfile MeasureSurface(const World& world, const Vec3d& centre_m, double yaw_rad,
                              double step_m);

}  // namespace grouser::dem
