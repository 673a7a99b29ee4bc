#include "clients/fmi/loader/fmu.h"

#include <dlfcn.h>

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <stdexcept>

#include "clients/fmi/loader/calls.h"

namespace grouser::fmi {
namespace {

using Tree = boost::property_tree::ptree;

std::string Attribute(const Tree& element, const char* name, const char* otherwise = "") {
  return element.get(std::string("<xmlattr>.") + name, otherwise);
}

Entry EntryOf(const Tree& element, const std::string& type) {
  Entry entry;
  entry.reference = element.get<unsigned>("<xmlattr>.valueReference");
  entry.type = type;
  entry.causality = Attribute(element, "causality", "local");
  entry.unit = Attribute(element, "unit");
  entry.start = Attribute(element, "start");
  entry.description = Attribute(element, "description");
  return entry;
}

// <ScalarVariable ...><Real unit="" start=""/></ScalarVariable>
Entry EntryOfScalar(const Tree& element) {
  static const std::map<std::string, std::string> types = {
      {"Real", "Float64"}, {"Integer", "Int32"}, {"Boolean", "Boolean"}};
  for (const auto& [name, typed] : element) {
    const auto type = types.find(name);
    if (type == types.end()) continue;
    Entry entry = EntryOf(element, type->second);
    entry.unit = Attribute(typed, "unit");
    entry.start = Attribute(typed, "start");
    return entry;
  }
  throw std::runtime_error(Attribute(element, "name") + ": expected Real, Integer or Boolean");
}

}  // namespace

Description ReadDescription(const std::filesystem::path& model_description) try {
  Tree file;
  boost::property_tree::read_xml(model_description.string(), file);
  const Tree& root = file.get_child("fmiModelDescription");
  Description read;
  const std::string version = Attribute(root, "fmiVersion");
  if (version.starts_with("2.")) read.version = 2;
  if (version.starts_with("3.")) read.version = 3;
  if (read.version == 0)
    throw std::runtime_error("fmiVersion \"" + version + "\", expected 2 or 3");
  read.model_name = Attribute(root, "modelName");
  read.token = Attribute(root, read.version == 2 ? "guid" : "instantiationToken");
  const Tree& kind = root.get_child("CoSimulation");
  read.identifier = Attribute(kind, "modelIdentifier");
  const char* save = read.version == 2 ? "canGetAndSetFMUstate" : "canGetAndSetFMUState";
  const char* serialize = read.version == 2 ? "canSerializeFMUstate" : "canSerializeFMUState";
  read.saves_state = Attribute(kind, save) == "true";
  read.serializes_state = Attribute(kind, serialize) == "true";
  for (const auto& [name, element] : root.get_child("ModelVariables")) {
    if (name == "<xmlattr>" || name == "<xmlcomment>") continue;
    const Entry entry = name == "ScalarVariable" ? EntryOfScalar(element) : EntryOf(element, name);
    read.variables.emplace(Attribute(element, "name"), entry);
  }
  return read;
} catch (const std::exception& error) {
  const std::string file = model_description.string(), what = error.what();
  throw std::runtime_error(what.starts_with(file) ? what : file + ": " + what);
}

Fmu::Fmu(const std::filesystem::path& folder)
    : description_(ReadDescription(folder / "modelDescription.xml")) {
  const bool third = description_.version == 3;
  const auto file = folder / "binaries" / (third ? "x86_64-linux" : "linux64") /
                    (description_.identifier + ".so");
  library_ = std::shared_ptr<void>(dlopen(std::filesystem::absolute(file).c_str(), RTLD_NOW),
                                   [](void* library) {
                                     if (library != nullptr) dlclose(library);
                                   });
  if (library_ == nullptr) throw std::runtime_error(file.string() + ": " + dlerror());
  try {
    const auto make = third ? MakeCalls3 : MakeCalls2;
    calls_ = make(library_.get(), description_, folder / "resources", &messages_);
  } catch (const std::exception& error) {
    Check(1, file.string() + ": " + error.what());
  }
}

Fmu::~Fmu() = default;

void Fmu::Check(int status, const std::string& call) const {
  if (status == 0) return;
  throw std::runtime_error(call + ": " + (messages_.empty() ? "refused" : messages_.back()));
}

unsigned Fmu::Reference(const std::string& name) const {
  const auto found = description_.variables.find(name);
  if (found != description_.variables.end()) return found->second.reference;
  throw std::runtime_error(name + ": the FMU has no such variable");
}

std::vector<unsigned> Fmu::References(const std::string& name) const {
  return {Reference(name + ".x"), Reference(name + ".y"), Reference(name + ".z")};
}

void Fmu::Initialize(double start_time) { Check(calls_->Initialize(start_time), "initialize"); }
void Fmu::Step(double time, double step) { Check(calls_->Step(time, step), "step"); }
void Fmu::Reset() { Check(calls_->Reset(), "reset"); }
void Fmu::Terminate() { Check(calls_->Terminate(), "terminate"); }

void Fmu::Set(const std::string& name, double value) {
  const unsigned reference = Reference(name);
  Set({&reference, 1}, {&value, 1});
}
void Fmu::Set(std::span<const unsigned> references, std::span<const double> values) {
  Check(calls_->Set(references, values), "set");
}
void Fmu::Get(std::span<const unsigned> references, std::span<double> values) const {
  Check(calls_->Get(references, values), "get");
}

double Fmu::Get(const std::string& name) const {
  const unsigned reference = Reference(name);
  const std::string& type = description_.variables.at(name).type;
  double value = 0;
  if (type == "Float64") {
    Get({&reference, 1}, {&value, 1});
  } else if (type == "Int32") {
    std::int32_t integer = 0;
    Check(calls_->GetInteger(reference, &integer), "get");
    value = integer;
  } else if (type == "Boolean") {
    bool yes = false;
    Check(calls_->GetBoolean(reference, &yes), "get");
    value = yes ? 1 : 0;
  } else {
    throw std::runtime_error(name + ": of type " + type + ", expected a number");
  }
  return value;
}

Fmu::State Fmu::Own(void* state) const {
  return {state, [this](void* freed) { (void)calls_->FreeState(&freed); }};
}
Fmu::State Fmu::Save() const {
  void* state = nullptr;
  Check(calls_->SaveState(&state), "save the state");
  return Own(state);
}
void Fmu::Restore(const State& state) {
  Check(calls_->RestoreState(state.get()), "restore the state");
}
Bytes Fmu::Serialize(const State& state) const {
  Bytes bytes;
  Check(calls_->Serialize(state.get(), &bytes), "serialize the state");
  return bytes;
}
Fmu::State Fmu::Deserialize(std::span<const std::uint8_t> bytes) const {
  void* state = nullptr;
  Check(calls_->Deserialize(bytes, &state), "deserialize the state");
  return Own(state);
}

}  // namespace grouser::fmi
