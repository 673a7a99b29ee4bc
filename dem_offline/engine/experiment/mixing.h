#pragma once

#include "dem_offline/engine/experiment/experiment.h"

namespace grouser::dem::experiment {

/// How well fine and coarse grains are mixed: 1 - s^2/(p (1 - p)), s^2 the variance of the fine
/// share of the solid volume over the bins (weighted by their solid volume) and p its mean: 1 minus
/// the intensity of segregation of Danckwerts (Appl. Sci. Res. A 3 (1952) 279). 0: apart; 1 minus
/// about 1 over the grains in a bin: at random. Grains count by their centres; NaN where all are
/// fine or none.
double MeasureMixing(const std::vector<GrainState>& grains, const Probe& probe);

void CheckMixing(const std::string& at, const Probe& probe);

}  // namespace grouser::dem::experiment
