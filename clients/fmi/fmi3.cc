// The C functions of FMI 3.0, for co-simulation.
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>

#include "fmi_types.h"
#include "wheel_fmu.h"

namespace {

using grouser::fmi::Type;
using grouser::fmi::WheelFmu;

struct Instance {
  WheelFmu fmu;
  fmi3InstanceEnvironment environment;
  fmi3LogMessageCallback log;
};

void Say(fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, const char* text) {
  if (log != nullptr) log(environment, fmi3Error, "logStatusError", text);
}

template <class Call>
fmi3Status On(fmi3Instance instance, const Call& call) {
  auto* at = static_cast<Instance*>(instance);
  if (at == nullptr) return fmi3Error;
  return grouser::fmi::Guarded(
      fmi3OK, fmi3Error, [at](const char* text) { Say(at->environment, at->log, text); },
      [&] { call(at->fmu); });
}

// For what an FMU has to have and this one does not offer; modelDescription.xml says so.
fmi3Status Unsupported(fmi3Instance instance, const char* what) {
  return On(instance, [what](WheelFmu&) {
    throw std::invalid_argument(std::string(what) + ": not offered by this FMU");
  });
}
// Variables of a type that there is none of.
fmi3Status NoVariable(fmi3Instance instance, std::size_t n, const char* type) {
  if (n == 0) return fmi3OK;
  return Unsupported(instance, type);
}

template <class T>
fmi3Status Get(fmi3Instance instance, Type type, const fmi3ValueReference* vr, std::size_t n,
               T* values, std::size_t n_values) {
  return On(instance,
            [&](WheelFmu& fmu) { fmu.Get(type, std::span(vr, n), std::span(values, n_values)); });
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
  return On(instance,
            [&](WheelFmu& fmu) { fmu.Set(std::span(vr, n), std::span(values, n_values)); });
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState* to) {
  return On(instance, [to](WheelFmu& fmu) {
    if (*to == nullptr) *to = new WheelFmu::State;
    *static_cast<WheelFmu::State*>(*to) = fmu.state();
  });
}
fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState from) {
  return On(instance, [from](WheelFmu& fmu) {
    if (from == nullptr) throw std::invalid_argument("FMU state: none was given");
    fmu.SetState(*static_cast<const WheelFmu::State*>(from));
  });
}
fmi3Status fmi3FreeFMUState(fmi3Instance, fmi3FMUState* state) {
  if (state == nullptr) return fmi3OK;
  delete static_cast<WheelFmu::State*>(*state);
  *state = nullptr;
  return fmi3OK;
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state,
                                      std::size_t* size) {
  return On(instance, [&](WheelFmu& fmu) {
    *size = fmu.Serialize(*static_cast<const WheelFmu::State*>(state)).size();
  });
}
fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte* to,
                                 std::size_t size) {
  return On(instance, [&](WheelFmu& fmu) {
    const auto bytes = fmu.Serialize(*static_cast<const WheelFmu::State*>(state));
    if (size < bytes.size()) throw std::invalid_argument("serialized state: too little room");
    std::memcpy(to, bytes.data(), bytes.size());
  });
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte* from, std::size_t size,
                                   fmi3FMUState* to) {
  return On(instance, [&](WheelFmu& fmu) {
    const WheelFmu::State state = fmu.Deserialize({from, size});
    if (*to == nullptr) *to = new WheelFmu::State;
    *static_cast<WheelFmu::State*>(*to) = state;
  });
}

// What the standard asks every FMU to have.
fmi3Status fmi3GetFloat32(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                          fmi3Float32*, std::size_t) {
  return NoVariable(instance, n, "variables of type Float32");
}
fmi3Status fmi3GetInt8(fmi3Instance instance, const fmi3ValueReference*, std::size_t n, fmi3Int8*,
                       std::size_t) {
  return NoVariable(instance, n, "variables of type Int8");
}
fmi3Status fmi3GetUInt8(fmi3Instance instance, const fmi3ValueReference*, std::size_t n, fmi3UInt8*,
                        std::size_t) {
  return NoVariable(instance, n, "variables of type UInt8");
}
fmi3Status fmi3GetInt16(fmi3Instance instance, const fmi3ValueReference*, std::size_t n, fmi3Int16*,
                        std::size_t) {
  return NoVariable(instance, n, "variables of type Int16");
}
fmi3Status fmi3GetUInt16(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                         fmi3UInt16*, std::size_t) {
  return NoVariable(instance, n, "variables of type UInt16");
}
fmi3Status fmi3GetUInt32(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                         fmi3UInt32*, std::size_t) {
  return NoVariable(instance, n, "variables of type UInt32");
}
fmi3Status fmi3GetInt64(fmi3Instance instance, const fmi3ValueReference*, std::size_t n, fmi3Int64*,
                        std::size_t) {
  return NoVariable(instance, n, "variables of type Int64");
}
fmi3Status fmi3GetUInt64(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                         fmi3UInt64*, std::size_t) {
  return NoVariable(instance, n, "variables of type UInt64");
}
fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                         fmi3String*, std::size_t) {
  return NoVariable(instance, n, "variables of type String");
}
fmi3Status fmi3SetFloat32(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                          const fmi3Float32*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type Float32");
}
fmi3Status fmi3SetInt8(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                       const fmi3Int8*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type Int8");
}
fmi3Status fmi3SetUInt8(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                        const fmi3UInt8*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type UInt8");
}
fmi3Status fmi3SetInt16(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                        const fmi3Int16*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type Int16");
}
fmi3Status fmi3SetUInt16(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                         const fmi3UInt16*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type UInt16");
}
fmi3Status fmi3SetUInt32(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                         const fmi3UInt32*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type UInt32");
}
fmi3Status fmi3SetInt64(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                        const fmi3Int64*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type Int64");
}
fmi3Status fmi3SetUInt64(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                         const fmi3UInt64*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type UInt64");
}
fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                         const fmi3String*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type String");
}
fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                        const fmi3Int32*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type Int32");
}
fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                          const fmi3Boolean*, std::size_t) {
  return NoVariable(instance, n, "setting variables of type Boolean");
}
fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                         std::size_t*, fmi3Binary*, std::size_t) {
  return NoVariable(instance, n, "variables of type Binary");
}
fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                         const std::size_t*, const fmi3Binary*, std::size_t) {
  return NoVariable(instance, n, "variables of type Binary");
}
fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                        fmi3Clock*) {
  return NoVariable(instance, n, "clocks");
}
fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference*, std::size_t n,
                        const fmi3Clock*) {
  return NoVariable(instance, n, "clocks");
}
fmi3Status fmi3EnterEventMode(fmi3Instance instance) { return Unsupported(instance, "event mode"); }
fmi3Status fmi3EnterStepMode(fmi3Instance instance) { return Unsupported(instance, "event mode"); }
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
  return Unsupported(instance, "event mode");
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean*, fmi3Boolean*, fmi3Boolean*,
                                    fmi3Boolean*, fmi3Boolean*, fmi3Float64*) {
  return Unsupported(instance, "event mode");
}
fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
  return Unsupported(instance, "configuration mode");
}
fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
  return Unsupported(instance, "configuration mode");
}
fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference,
                                               std::size_t*) {
  return Unsupported(instance, "dependencies of variables");
}
fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference, std::size_t*,
                                       fmi3ValueReference*, std::size_t*, fmi3DependencyKind*,
                                       std::size_t) {
  return Unsupported(instance, "dependencies of variables");
}
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference*,
                                        std::size_t, const fmi3ValueReference*, std::size_t,
                                        const fmi3Float64*, std::size_t, fmi3Float64*,
                                        std::size_t) {
  return Unsupported(instance, "derivatives");
}
fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference*, std::size_t,
                                    const fmi3ValueReference*, std::size_t, const fmi3Float64*,
                                    std::size_t, fmi3Float64*, std::size_t) {
  return Unsupported(instance, "derivatives");
}
fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference*, std::size_t,
                                    const fmi3Int32*, fmi3Float64*, std::size_t) {
  return Unsupported(instance, "derivatives");
}
fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference*, std::size_t,
                                  fmi3Float64*, fmi3IntervalQualifier*) {
  return Unsupported(instance, "clocks");
}
fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference*, std::size_t,
                                   fmi3UInt64*, fmi3UInt64*, fmi3IntervalQualifier*) {
  return Unsupported(instance, "clocks");
}
fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference*, std::size_t,
                               fmi3Float64*) {
  return Unsupported(instance, "clocks");
}
fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference*, std::size_t,
                                fmi3UInt64*, fmi3UInt64*) {
  return Unsupported(instance, "clocks");
}
fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference*, std::size_t,
                                  const fmi3Float64*) {
  return Unsupported(instance, "clocks");
}
fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference*, std::size_t,
                                   const fmi3UInt64*, const fmi3UInt64*) {
  return Unsupported(instance, "clocks");
}
fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference*, std::size_t,
                               const fmi3Float64*) {
  return Unsupported(instance, "clocks");
}
fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference*, std::size_t,
                                const fmi3UInt64*, const fmi3UInt64*) {
  return Unsupported(instance, "clocks");
}

}  // extern "C"
#pragma GCC visibility pop
