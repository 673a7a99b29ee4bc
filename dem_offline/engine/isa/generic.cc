// The path of any legal combination of laws and any number of materials: lane
// by lane, for the baseline instruction set alone.
#include "dem_offline/engine/contact/pair_kernel.h"

#define GROUSER_ISA_NS generic
#include "dem_offline/engine/contact/pair_kernel.inl"

namespace grouser::dem {
PairKernelFn GenericPairKernel(bool energy) {
  return energy ? generic::Blocks<AnyLaws, true> : generic::Blocks<AnyLaws, false>;
}
}  // namespace grouser::dem
