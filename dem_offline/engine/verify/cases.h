#pragma once

#include "dem_offline/engine/verify/suite.h"

// What each file of cases hands to the suites, in the order of the tables.

namespace grouser::dem::verify {

Cases ImpactCases();
Cases TangentialCases();
Cases RollingCases();
Cases RestitutionCases();
Cases CohesionAndBondCases();
Cases MotionCases();
Cases WheelEnergyCases();
Cases SimilarityCases();
Cases PackingCases();
Cases PileCases();
Cases FlowCases();

Cases StiffCases();  ///< size and stiffness ratios, steps, speeds, overlaps
Cases PlaceCases();  ///< far away, gravity, one grain, none, slow creep, symmetries
Cases WheelTortureCases();
Cases EnduranceCases();  ///< JKR snap-off, bond cascade, a heap at rest, a million steps
Cases MeshCases();
Cases BodyCases();  ///< clumps, glued spheres, planar worlds
Cases DeterminismCases();

}  // namespace grouser::dem::verify
