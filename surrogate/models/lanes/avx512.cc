#define GROUSER_ISA_NS lanes_avx512
#define GROUSER_LANES 8
#include "surrogate/models/lanes/solve.inl"
