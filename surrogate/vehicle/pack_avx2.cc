#define GROUSER_ISA_NS isa_avx2
#define GROUSER_LANES 4
#include "surrogate/vehicle/pack_kernel.inl"
