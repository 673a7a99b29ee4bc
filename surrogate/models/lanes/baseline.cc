#define GROUSER_ISA_NS lanes_baseline
#define GROUSER_LANES 2
#include "surrogate/models/lanes/solve.inl"
