#include "dem_offline/engine/isa/kernels.h"

#define GROUSER_ISA_NS isa_avx2
#include "dem_offline/engine/contact/pair_kernel.inl"
#include "dem_offline/engine/core/drift_kernel.inl"

namespace grouser::dem::isa_avx2 {
Kernels All(int combination, bool energy) {
  return {Choose(combination, energy, CompiledCombinations{}), SumTiles, DriftTiles};
}
}  // namespace grouser::dem::isa_avx2
