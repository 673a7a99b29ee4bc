#define GROUSER_ISA_NS isa_avx2
#define GROUSER_LANES 4
#include "surrogate/models/hard_ground_kernel.inl"
