#include "dem_offline/engine/contact/pair_kernel.h"

#define GROUSER_ISA_NS isa_avx2
#include "dem_offline/engine/contact/pair_kernel.inl"
