#pragma once

#include "dem_offline/engine/rig/kinematics.h"
#include "dem_offline/engine/rig/scene.h"
#include "dem_offline/engine/rig/steady.h"
#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {

/// Steady means, their errors, and the motion that ran.
void FillMeans(const WheelTestSpec& spec, const SteadyWindow& window, const Motion& target,
               double beta, WheelTestResult& out);

/// Means over the stretch of hub travel that runs are compared on, where the run went so far.
void FillEqualTravel(const TravelSettings& travel, const Motion& target, WheelTestResult& out);

/// Channels since `start`, and the residual: input - kinetic - potential -
/// stored - dissipated - taken by freezing and exchange.
void FillEnergy(const EnergyBalance& start, const EnergyBalance& end, EnergyLedger& ledger);

/// Share of the energy that nobody accounts for: |residual| over the larger of
/// the input and what was dissipated. A step that is too long shows here.
double EnergyError(const EnergyLedger& ledger);
inline constexpr double kLargestEnergyError = 0.02;

/// Bed, numbers and size rules (docs/engine.md, "Size rules").
void FillBedAndRules(const WheelTestSpec& spec, const Tile& tile, const World& world,
                     WheelTestResult& out);

/// Size rules of the window and of freezing, where they are on.
void FillSceneRules(const WheelTestSpec& spec, const RigScene& scene, WheelTestResult& out);

}  // namespace grouser::dem
