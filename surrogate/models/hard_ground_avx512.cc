#define GROUSER_ISA_NS isa_avx512
#define GROUSER_LANES 8
#include "surrogate/models/hard_ground_kernel.inl"
