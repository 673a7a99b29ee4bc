#include "surrogate/models/response_kernel.h"

#define GROUSER_ISA_NS isa_baseline
#include "surrogate/models/response_kernel.inl"
