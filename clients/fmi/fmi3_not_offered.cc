// What FMI 3.0 asks every FMU to have and this one does not offer.
#include <stdexcept>
#include <string>

#include "fmi3_instance.h"

namespace {

// modelDescription.xml says so as well.
fmi3Status Unsupported(fmi3Instance instance, const char* what) {
  return grouser::fmi::On(instance, [what](grouser::fmi::WheelFmu&) {
    throw std::invalid_argument(std::string(what) + ": not offered by this FMU");
  });
}
// Variables of a type that there is none of.
fmi3Status NoVariable(fmi3Instance instance, std::size_t n, const char* type) {
  if (n == 0) return fmi3OK;
  return Unsupported(instance, type);
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

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
