// The C functions of FMI 2.0, for co-simulation.
#include <algorithm>
#include <stdexcept>
#include <string>
#include <string_view>

#include "fmi_types.h"
#include "wheel_fmu.h"

namespace {

using grouser::fmi::Given;
using grouser::fmi::Type;
using grouser::fmi::WheelFmu;

constexpr char kReferences[] = "value references", kValues[] = "values";

struct Component {
  WheelFmu fmu;
  fmi2CallbackFunctions host;
  std::string name;
};

void Log(const fmi2CallbackFunctions& host, const char* name, const char* text) {
  if (host.logger == nullptr) return;
  host.logger(host.componentEnvironment, name, fmi2Error, "logStatusError", "%s", text);
}

template <class Call>
fmi2Status With(fmi2Component component, const Call& call) {
  auto* at = static_cast<Component*>(component);
  if (at == nullptr) return fmi2Error;
  return grouser::fmi::Guarded(
      fmi2OK, fmi2Error, [at](const char* text) { Log(at->host, at->name.c_str(), text); },
      [&] { call(at->fmu); });
}

// For what an FMU has to have and this one does not offer; modelDescription.xml says so.
fmi2Status NotOffered(fmi2Component component, const char* what) {
  return With(component, [what](WheelFmu&) {
    throw std::invalid_argument(std::string(what) + ": not offered by this FMU");
  });
}

// "file:///a%20b" -> "/a b"; a path stays as it is.
std::string PathOf(std::string_view uri) {
  if (!uri.starts_with("file:")) return std::string(uri);
  uri.remove_prefix(5);
  if (uri.starts_with("//")) uri.remove_prefix(std::min(uri.find('/', 2), uri.size()));
  std::string path;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size()) {
      path += static_cast<char>(std::stoi(std::string(uri.substr(i + 1, 2)), nullptr, 16));
      i += 2;
    } else {
      path += uri[i];
    }
  }
  return path;
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

const char* fmi2GetTypesPlatform() { return "default"; }
const char* fmi2GetVersion() { return "2.0"; }
fmi2Status fmi2SetDebugLogging(fmi2Component, fmi2Boolean, std::size_t, const fmi2String*) {
  return fmi2OK;  // there are no messages but of errors
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* host, fmi2Boolean, fmi2Boolean) {
  const fmi2CallbackFunctions callbacks = host == nullptr ? fmi2CallbackFunctions{} : *host;
  Component* made = nullptr;
  grouser::fmi::Guarded(
      fmi2OK, fmi2Error,
      [&](const char* text) { Log(callbacks, name == nullptr ? "" : name, text); },
      [&] {
        if (type != fmi2CoSimulation) {
          throw std::invalid_argument("model exchange: not offered by this FMU");
        }
        if (resources == nullptr) throw std::invalid_argument("resource location: none was given");
        made = new Component{WheelFmu(PathOf(resources), guid == nullptr ? "" : guid), callbacks,
                             name == nullptr ? "" : name};
      });
  return made;
}
void fmi2FreeInstance(fmi2Component component) { delete static_cast<Component*>(component); }

fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean, fmi2Real, fmi2Real start,
                               fmi2Boolean, fmi2Real) {
  return With(component, [start](WheelFmu& fmu) { fmu.SetUp(start); });
}
fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
  return With(component, [](WheelFmu& fmu) {
    if (fmu.state().set_up == 0) {
      throw std::logic_error(
          "enter initialization mode: expected a setup of the experiment before");
    }
    fmu.EnterInitialization(fmu.time());
  });
}
fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
  return With(component, [](WheelFmu& fmu) { fmu.ExitInitialization(); });
}
fmi2Status fmi2Terminate(fmi2Component component) {
  return With(component, [](WheelFmu& fmu) { fmu.Terminate(); });
}
fmi2Status fmi2Reset(fmi2Component component) {
  return With(component, [](WheelFmu& fmu) { fmu.Reset(); });
}
fmi2Status fmi2DoStep(fmi2Component component, fmi2Real time, fmi2Real step, fmi2Boolean) {
  return With(component, [&](WheelFmu& fmu) { fmu.DoStep(time, step); });
}
fmi2Status fmi2CancelStep(fmi2Component component) {
  return NotOffered(component, "steps that run in the background");
}

fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference* vr, std::size_t n,
                       fmi2Real* values) {
  return With(component, [&](WheelFmu& fmu) {
    fmu.Get(Type::kFloat64, Given(vr, n, kReferences), Given(values, n, kValues));
  });
}
fmi2Status fmi2GetInteger(fmi2Component component, const fmi2ValueReference* vr, std::size_t n,
                          fmi2Integer* values) {
  return With(component, [&](WheelFmu& fmu) {
    fmu.Get(Type::kInt32, Given(vr, n, kReferences), Given(values, n, kValues));
  });
}
fmi2Status fmi2GetBoolean(fmi2Component component, const fmi2ValueReference* vr, std::size_t n,
                          fmi2Boolean* values) {
  return With(component, [&](WheelFmu& fmu) {
    fmu.Get(Type::kBoolean, Given(vr, n, kReferences), Given(values, n, kValues));
  });
}
fmi2Status fmi2GetString(fmi2Component component, const fmi2ValueReference*, std::size_t n,
                         fmi2String*) {
  return n == 0 ? fmi2OK : NotOffered(component, "variables of type String");
}
fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference* vr, std::size_t n,
                       const fmi2Real* values) {
  return With(component, [&](WheelFmu& fmu) {
    fmu.Set(Given(vr, n, kReferences), Given(values, n, kValues));
  });
}
fmi2Status fmi2SetInteger(fmi2Component component, const fmi2ValueReference*, std::size_t n,
                          const fmi2Integer*) {
  return n == 0 ? fmi2OK : NotOffered(component, "setting variables of type Integer");
}
fmi2Status fmi2SetBoolean(fmi2Component component, const fmi2ValueReference*, std::size_t n,
                          const fmi2Boolean*) {
  return n == 0 ? fmi2OK : NotOffered(component, "setting variables of type Boolean");
}
fmi2Status fmi2SetString(fmi2Component component, const fmi2ValueReference*, std::size_t n,
                         const fmi2String*) {
  return n == 0 ? fmi2OK : NotOffered(component, "variables of type String");
}

fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate* to) {
  return With(component, [to](WheelFmu& fmu) { grouser::fmi::SaveState(fmu, to); });
}
fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate from) {
  return With(component, [from](WheelFmu& fmu) { grouser::fmi::RestoreState(from, &fmu); });
}
fmi2Status fmi2FreeFMUstate(fmi2Component, fmi2FMUstate* state) {
  if (state == nullptr) return fmi2OK;
  delete static_cast<WheelFmu::State*>(*state);
  *state = nullptr;
  return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate state,
                                      std::size_t* size) {
  return With(component, [&](WheelFmu& fmu) { grouser::fmi::SerializedSize(fmu, state, size); });
}
fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate state, fmi2Byte* to,
                                 std::size_t size) {
  return With(component,
              [&](WheelFmu& fmu) { grouser::fmi::SerializeState(fmu, state, to, size); });
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte* from, std::size_t size,
                                   fmi2FMUstate* to) {
  return With(component,
              [&](WheelFmu& fmu) { grouser::fmi::DeserializeState(fmu, from, size, to); });
}

// What the standard asks every FMU to have.
fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference*,
                                        std::size_t, const fmi2ValueReference*, std::size_t,
                                        const fmi2Real*, fmi2Real*) {
  return NotOffered(component, "derivatives");
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference*,
                                       std::size_t, const fmi2Integer*, const fmi2Real*) {
  return NotOffered(component, "derivatives");
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference*,
                                        std::size_t, const fmi2Integer*, fmi2Real*) {
  return NotOffered(component, "derivatives");
}
fmi2Status fmi2GetStatus(fmi2Component component, fmi2StatusKind, fmi2Status*) {
  return NotOffered(component, "steps that run in the background");
}
fmi2Status fmi2GetRealStatus(fmi2Component component, fmi2StatusKind kind, fmi2Real* value) {
  return With(component, [&](WheelFmu& fmu) {
    if (kind != fmi2LastSuccessfulTime) {
      throw std::invalid_argument("status: a number is known of the last successful time alone");
    }
    *Given(value, "value") = fmu.time();
  });
}
fmi2Status fmi2GetIntegerStatus(fmi2Component component, fmi2StatusKind, fmi2Integer*) {
  return NotOffered(component, "steps that run in the background");
}
fmi2Status fmi2GetBooleanStatus(fmi2Component component, fmi2StatusKind kind, fmi2Boolean* value) {
  return With(component, [&](WheelFmu&) {
    if (kind != fmi2Terminated) {
      throw std::invalid_argument("status: yes or no is known of the end of simulation alone");
    }
    *Given(value, "value") = 0;  // it never asks for that
  });
}
fmi2Status fmi2GetStringStatus(fmi2Component component, fmi2StatusKind, fmi2String*) {
  return NotOffered(component, "steps that run in the background");
}

}  // extern "C"
#pragma GCC visibility pop
