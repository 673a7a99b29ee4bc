#define GROUSER_ISA_NS isa_baseline
#define GROUSER_LANES 2
#include "surrogate/vehicle/pack_kernel.inl"
