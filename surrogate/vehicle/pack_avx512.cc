#define GROUSER_ISA_NS isa_avx512
#define GROUSER_LANES 8
#include "surrogate/vehicle/pack_kernel.inl"
