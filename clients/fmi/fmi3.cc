// The C functions of FMI 3.0, for co-simulation.
#include <stdexcept>
#include <string>

#include "fmi3_instance.h"

namespace {

using grouser::fmi::Given;
using grouser::fmi::Instance;
using grouser::fmi::On;
using grouser::fmi::Say;
using grouser::fmi::Type;
using grouser::fmi::WheelFmu;

constexpr char kReferences[] = "value references", kValues[] = "values";

template <class T>
fmi3Status Get(fmi3Instance instance, Type type, const fmi3ValueReference* vr, std::size_t n,
               T* values, std::size_t n_values) {
  return On(instance, [&](WheelFmu& fmu) {
    fmu.Get(type, Given(vr, n, kReferences), Given(values, n_values, kValues));
  });
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

const char* fmi3GetVersion() { return "3.0"; }
fmi3Status fmi3SetDebugLogging(fmi3Instance, fmi3Boolean, std::size_t, const fmi3String*) {
  return fmi3OK;  // there are no messages but of errors
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String, fmi3String token, fmi3String resources,
                                         fmi3Boolean, fmi3Boolean, fmi3Boolean event_mode,
                                         fmi3Boolean, const fmi3ValueReference*, std::size_t,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback) {
  Instance* made = nullptr;
  grouser::fmi::Guarded(
      fmi3OK, fmi3Error, [&](const char* text) { Say(environment, log, text); },
      [&] {
        if (event_mode) throw std::invalid_argument("event mode: not offered by this FMU");
        if (resources == nullptr) throw std::invalid_argument("resource path: none was given");
        made = new Instance{WheelFmu(resources, token == nullptr ? "" : token), environment, log};
      });
  return made;
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String, fmi3String, fmi3String, fmi3Boolean,
                                          fmi3Boolean, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
  Say(environment, log, "model exchange: not offered by this FMU");
  return nullptr;
}
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String, fmi3String, fmi3String, fmi3Boolean,
                                               fmi3Boolean, fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback log, fmi3ClockUpdateCallback,
                                               fmi3LockPreemptionCallback,
                                               fmi3UnlockPreemptionCallback) {
  Say(environment, log, "scheduled execution: not offered by this FMU");
  return nullptr;
}
void fmi3FreeInstance(fmi3Instance instance) { delete static_cast<Instance*>(instance); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean, fmi3Float64,
                                       fmi3Float64 start, fmi3Boolean, fmi3Float64) {
  return On(instance, [&](WheelFmu& fmu) { fmu.EnterInitialization(start); });
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
  return On(instance, [](WheelFmu& fmu) { fmu.ExitInitialization(); });
}
fmi3Status fmi3Terminate(fmi3Instance instance) {
  return On(instance, [](WheelFmu& fmu) { fmu.Terminate(); });
}
fmi3Status fmi3Reset(fmi3Instance instance) {
  return On(instance, [](WheelFmu& fmu) { fmu.Reset(); });
}
fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean,
                      fmi3Boolean* event_needed, fmi3Boolean* terminate, fmi3Boolean* early,
                      fmi3Float64* last_time) {
  for (fmi3Boolean* no : {event_needed, terminate, early}) {
    if (no != nullptr) *no = false;
  }
  return On(instance, [&](WheelFmu& fmu) {
    if (last_time != nullptr) *last_time = fmu.time();
    fmu.DoStep(time, step);
    if (last_time != nullptr) *last_time = fmu.time();
  });
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference* vr, std::size_t n,
                          fmi3Float64* values, std::size_t n_values) {
  return Get(instance, Type::kFloat64, vr, n, values, n_values);
}
fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference* vr, std::size_t n,
                        fmi3Int32* values, std::size_t n_values) {
  return Get(instance, Type::kInt32, vr, n, values, n_values);
}
fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference* vr, std::size_t n,
                          fmi3Boolean* values, std::size_t n_values) {
  return Get(instance, Type::kBoolean, vr, n, values, n_values);
}
fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference* vr, std::size_t n,
                          const fmi3Float64* values, std::size_t n_values) {
  return On(instance, [&](WheelFmu& fmu) {
    fmu.Set(Given(vr, n, kReferences), Given(values, n_values, kValues));
  });
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState* to) {
  return On(instance, [to](WheelFmu& fmu) { grouser::fmi::SaveState(fmu, to); });
}
fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState from) {
  return On(instance, [from](WheelFmu& fmu) { grouser::fmi::RestoreState(from, &fmu); });
}
fmi3Status fmi3FreeFMUState(fmi3Instance, fmi3FMUState* state) {
  if (state == nullptr) return fmi3OK;
  delete static_cast<WheelFmu::State*>(*state);
  *state = nullptr;
  return fmi3OK;
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state,
                                      std::size_t* size) {
  return On(instance, [&](WheelFmu& fmu) { grouser::fmi::SerializedSize(fmu, state, size); });
}
fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte* to,
                                 std::size_t size) {
  return On(instance, [&](WheelFmu& fmu) { grouser::fmi::SerializeState(fmu, state, to, size); });
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte* from, std::size_t size,
                                   fmi3FMUState* to) {
  return On(instance, [&](WheelFmu& fmu) { grouser::fmi::DeserializeState(fmu, from, size, to); });
}

}  // extern "C"
#pragma GCC visibility pop
