#pragma once

#include "dem_offline/engine/bench/bed.h"

namespace grouser::dem::bench {

/// A bed between two rough plates (its own lowest and highest grains, glued)
/// that glide past one another along x, without gravity. Made under constant
/// normal stress until the shear is steady, kept and timed at constant volume:
/// the one condition that needs no controller and that any code repeats.
/// Starts from MakeBed(source); velocities are part of the bed.
///   I = shear rate x d sqrt(density/stress_zz) = `inertial_number`
/// where stress_zz is `stress_pa` [Pa]. Deterministic.
Bed MakeShearBed(const BedSource& source, double inertial_number = 0.01, double stress_pa = 1500);

}  // namespace grouser::dem::bench
