#define GROUSER_ISA_NS isa_avx512
#define GROUSER_LANES 8
#include "surrogate/models/draw_field_kernel.inl"
