// The two tables, in the order they are printed.
#include <initializer_list>

#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

Cases Joined(std::initializer_list<Cases> groups) {
  Cases out;
  for (const Cases& g : groups) out.insert(out.end(), g.begin(), g.end());
  return out;
}

}  // namespace

Suite VerifySuite() {
  return {"verify",
          "The engine against exact and published answers: a row is one number, where it comes "
          "from, and how far the engine may be off.",
          Joined({ImpactCases(), TangentialCases(), RollingCases(), RestitutionCases(),
                  CohesionAndBondCases(), MotionCases(), WheelEnergyCases(), SimilarityCases(),
                  PackingCases(), PileCases(), FlowCases()})};
}

Suite TortureSuite() {
  return {"torture",
          "Cases chosen to break the engine: none may crash, hang, go non-finite unnoticed, or be "
          "averaged after failing.",
          Joined({StiffCases(), PlaceCases(), WheelTortureCases(), EnduranceCases(), MeshCases(),
                  BodyCases(), DeterminismCases()})};
}

}  // namespace grouser::dem::verify
