#define GROUSER_ISA_NS lanes_avx2
#define GROUSER_LANES 4
#include "surrogate/models/lanes/solve.inl"
