#pragma once

#include "fmi_types.h"
#include "wheel_fmu.h"

/// What fmi3.cc and fmi3_not_offered.cc share: an instance of FMI 3.0 and calls on it.
namespace grouser::fmi {

struct Instance {
  WheelFmu fmu;
  fmi3InstanceEnvironment environment;
  fmi3LogMessageCallback log;
};

inline void Say(fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, const char* text) {
  if (log != nullptr) log(environment, fmi3Error, "logStatusError", text);
}

template <class Call>
fmi3Status On(fmi3Instance instance, const Call& call) {
  auto* at = static_cast<Instance*>(instance);
  if (at == nullptr) return fmi3Error;
  return Guarded(
      fmi3OK, fmi3Error, [at](const char* text) { Say(at->environment, at->log, text); },
      [&] { call(at->fmu); });
}

}  // namespace grouser::fmi
