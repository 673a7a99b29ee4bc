#pragma once

#include "dem_offline/engine/verify/suite.h"

// What each file of cases hands to the suites, in the order of the tables.

namespace grouser::dem::verify {

Cases HertzCases();
Cases BounceCases();
Cases ObliqueCases();
Cases TangentialCases();
Cases RollingCases();
Cases RestitutionCases();
Cases CohesionCases();
Cases BondCases();
Cases ChainCases();
Cases OrderCases();
Cases MomentumCases();
Cases WheelEnergyCases();
Cases SimilarityCases();
Cases PackingCases();
Cases PileCases();
Cases HeapCases();
Cases HopperCases();
Cases ColumnCases();

Cases StiffCases();  ///< size and stiffness ratios, steps, speeds, overlaps
Cases PlaceCases();  ///< far away, gravity, one grain, none, slow creep
Cases WheelTortureCases();
Cases SnapCases();       ///< JKR snap-off, bond cascade
Cases EnduranceCases();  ///< a heap at rest, a million steps
Cases MeshCases();
Cases DeterminismCases();
Cases SymmetryCases();

}  // namespace grouser::dem::verify
