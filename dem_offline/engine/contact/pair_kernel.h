#pragma once

#include <cstdint>

#include "dem_offline/engine/laws/recipe.h"
#include "dem_offline/engine/world/grain.h"

namespace grouser::dem {

/// Energy of one sweep [J]; pair contacts are counted once.
struct EnergySums {
  double stored = 0, normal_damping = 0, tangent_damping = 0, slip = 0, rolling = 0;
};

/// What the pair kernel sees: plain arrays, no owner.
/// Slots: tile t owns rows[t] rows of kLanes slots from first_slot[t] on; slot
/// (row k, lane l) is the k-th candidate partner of grain t * kLanes + l. An
/// empty slot names the grain itself. Both sides of a contact keep it.
struct PairView {
  const Grain* grains;
  GrainLoad* loads;                  ///< overwritten
  int tiles;
  const std::int64_t* first_slot;    ///< [tiles + 1]
  const std::int32_t* partner;       ///< [slots]
  float* history[kHistoryWords];     ///< [slots] each; 0 where not touching
  std::uint8_t* row_touches;         ///< [slots / kLanes] did any lane touch last step?
  float quantum[3];                  ///< [m]
  HertzMindlinEpsd::Params params;
  float dt;                          ///< [s]
  EnergySums* energy;                ///< null: not asked for
};

/// Forces of all grain-grain contacts. Bitwise the same for every instruction
/// set and for any split of the tiles.
void PairForces(const PairView& view);

/// "avx512", "avx2" or "baseline": what PairForces uses on this machine.
/// GROUSER_ISA in the environment can lower it (tests).
const char* PairKernelIsa();

/// The same kernel compiled for one instruction set (tests, dispatch).
using PairKernelFn = void (*)(const PairView&);
PairKernelFn PairKernelFor(const char* isa);  ///< null: not on this machine

}  // namespace grouser::dem
