#pragma once

#include <limits>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/body.h"
#include "dem_offline/engine/experiment/experiment.h"

namespace grouser::dem::experiment {

/// A wheel's treads in the soil, and the soil that flows around it. Angles about the axle from
/// straight down, positive towards +x; the wheel is expected to go that way.
struct TreadState {
  double tread_rad = 0;  ///< of the tread nearest to straight down
  /// Of the foremost and of the hindmost tread that a grain touches; NaN: none does.
  double entry_rad = std::numeric_limits<double>::quiet_NaN();
  double exit_rad = std::numeric_limits<double>::quiet_NaN();
  /// Grains whose speed is 20 to 100 % of that of the treads' tips about the axle: how many, the
  /// sum of their areas pi r^2, and the mean of their speeds [m/s] (0: none).
  double flow_grains = 0, flow_area_m2 = 0, flow_m_per_s = 0;
};
/// The body's first ring of treads counts. period_m: of the frame along x.
TreadState MeasureTreads(const std::vector<GrainState>& grains, const Body& body, double period_m);

/// Throws SpecError for a probe of a body without treads.
void CheckTreads(const Experiment& e, const std::string& at, const Probe& probe);

}  // namespace grouser::dem::experiment
