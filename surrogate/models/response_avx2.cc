#include "surrogate/models/response_kernel.h"

#define GROUSER_ISA_NS isa_avx2
#include "surrogate/models/response_kernel.inl"
