#pragma once

#include "dem_offline/engine/bench/workload.h"
#include "dem_offline/engine/bodies/mesh.h"
#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem::bench {

/// A smooth wheel on a bed at slip, with a motion that any code can repeat:
///   v_x = (1 - slip) V, rim speed V, from the start on;
///   v_z = (F_z - load)/c, c = load/(0.2 m/s)
/// a massless hub held by a damper: it falls at 0.2 m/s, and comes to rest
/// where the soil carries the load. F_z [N]: of the step before.
struct WheelBench {
  WheelShape wheel;
  double load_n = 24, slip = 0.3, speed_m_per_s = 0.1, damper_n_s_per_m = 24 / 0.2;
  double sample_s = 1e-3;                   ///< forces are averaged over
  double clearance_m = 1e-4;                ///< of the wheel to begin with
  double settle_s = 0.2;                    ///< not looked at: the wheel comes down
  double first_look_s = 0.5, look_s = 0.1;  ///< at the stopping rule
  double longest_s = 1.95;                  ///< the peer's mesh must not leave its box
  int sides = 0;                            ///< a closed mesh, a prism of so many; 0: round
};

/// A regular prism about y as a closed mesh, its mean radius that of the wheel: corners stand out
/// as far as sides fall short; a corner at the top. The same mesh goes to the peer.
TriangleSoup PrismWheel(const WheelShape& wheel, int sides);

/// Looks at a series as a run does while it grows.
WheelVerdict Judge(const Series& series, const WheelBench& bench);

/// Means and errors over a given window, whatever the rule says: for comparing two codes over the
/// same stretch. Throws std::invalid_argument for a window without 16 samples.
WheelVerdict Judge(const Series& series, double from_s, double to_s);

/// The bed as a rig has it: flat at z = 0, no contact histories.
Tile TileOf(const Bed& bed);
WheelTestSpec SpecOf(const BenchOptions& options, const Bed& bed, const WheelBench& bench);
/// A bed for the wheel: coarse grains, 0.28 m x 0.20 m, cut flat.
Bed MakeWheelBed(const BedSource& source);

/// One run until the rule stops it (or longest_s); appends to the result's
/// rates, and fills its phases and `wheel`.
void RunWheel(const Bed& bed, BenchResult* result);

/// Time, F_x, F_y, F_z, torque, sinkage, travel a line, in SI; for Judge.
void SaveSeries(const Series& series, const std::string& path);
Series LoadSeries(const std::string& path);

}  // namespace grouser::dem::bench
