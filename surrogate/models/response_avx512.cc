#include "surrogate/models/response_kernel.h"

#define GROUSER_ISA_NS isa_avx512
#include "surrogate/models/response_kernel.inl"
