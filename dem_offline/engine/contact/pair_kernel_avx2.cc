#include "dem_offline/engine/contact/pair_kernel.h"

#define GROUSER_ISA_NS isa_avx2
#include "dem_offline/engine/contact/pair_kernel.inl"

namespace grouser::dem::isa_avx2 {
PairKernelFn Kernel(int recipe, bool energy) { return Choose(recipe, energy, Recipes{}); }
}  // namespace grouser::dem::isa_avx2
