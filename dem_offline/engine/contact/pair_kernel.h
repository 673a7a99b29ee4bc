#pragma once

#include <cstdint>

#include "dem_offline/engine/laws/generic.h"
#include "dem_offline/engine/world/grain.h"

namespace grouser::dem {

/// Energy of one sweep [J]; pair contacts are counted once.
struct EnergySums {
  double stored = 0, normal_damping = 0, tangent_damping = 0, slip = 0, rolling = 0, plastic = 0,
         cohesion = 0;
  void Add(const EnergySums& o) {
    stored += o.stored;
    normal_damping += o.normal_damping;
    tangent_damping += o.tangent_damping;
    slip += o.slip;
    rolling += o.rolling;
    plastic += o.plastic;
    cohesion += o.cohesion;
  }
};

/// What the pair kernel sees: plain arrays, no owner.
/// Slots: tile t owns rows of kLanes slots from first_slot[t] on; slot
/// (row k, lane l) is the k-th candidate partner of grain t * kLanes + l. An
/// empty slot names the grain itself. Both sides of a contact keep it.
struct PairView {
  const Grain* grains;
  GrainLoad* loads;                  ///< overwritten
  int tiles;
  const std::int64_t* first_slot;    ///< [tiles + 1]
  const std::int32_t* partner;       ///< [slots]
  float* history[kMaxHistoryWords];  ///< [slots] each; 0 where not touching
  std::uint8_t* row_touches;         ///< [slots / kLanes] did any lane touch last step?
  float quantum[3];                  ///< [m]
  float range;                       ///< furthest gap at which the laws act [m]
  float dt;                          ///< [s]
  const PairParams* params;          ///< [materials x materials]
  int materials;
  LawChoice laws;
  WordLayout layout;
};

/// Forces of all grain-grain contacts of tiles [first, last); adds to *energy
/// unless it is null. Bitwise the same for every instruction set and for any
/// split of the tiles.
using PairKernelFn = void (*)(const PairView&, int first, int last, EnergySums* energy);

/// The kernel for a recipe of the menu (-1: the generic path), which reads the
/// parameters of material pair (0, 0) only unless it is the generic one.
PairKernelFn PairKernel(int recipe, bool energy);
/// "avx512", "avx2" or "baseline": what PairKernel returns on this machine.
/// GROUSER_ISA in the environment can lower it (tests).
const char* PairKernelIsa();
/// The same compiled for one instruction set; null: not on this machine.
PairKernelFn PairKernelFor(const char* isa, int recipe, bool energy);

}  // namespace grouser::dem
