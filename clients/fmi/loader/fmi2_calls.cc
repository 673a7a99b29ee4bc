#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include "clients/fmi/fmi_types.h"
#include "clients/fmi/loader/calls.h"

namespace grouser::fmi {
namespace {

void NoteOf2(fmi2ComponentEnvironment to, fmi2String, fmi2Status, fmi2String, fmi2String format,
             ...) {
  char text[1000];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  static_cast<std::vector<std::string>*>(to)->emplace_back(text);
}

// The standard: a URI.
std::string UriOf(const std::filesystem::path& folder) {
  std::string uri = "file://";
  for (const char c : std::filesystem::absolute(folder).string()) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 ||
        std::string("/-_.~").find(c) != std::string::npos) {
      uri += c;
    } else {
      char code[4];
      std::snprintf(code, sizeof code, "%%%02X", static_cast<unsigned char>(c));
      uri += code;
    }
  }
  return uri;
}

class Calls2 final : public Calls {
 public:
  Calls2(void* library, const Description& description, const std::filesystem::path& resources,
         std::vector<std::string>* messages)
      : host_{NoteOf2, std::calloc, std::free, nullptr, messages} {
    fmi2Component (*instantiate)(fmi2String, fmi2Type, fmi2String, fmi2String,
                                 const fmi2CallbackFunctions*, fmi2Boolean, fmi2Boolean);
    Find(library, "fmi2Instantiate", &instantiate);
    Find(library, "fmi2FreeInstance", &free_);
    Find(library, "fmi2SetupExperiment", &setup_);
    Find(library, "fmi2EnterInitializationMode", &enter_);
    Find(library, "fmi2ExitInitializationMode", &exit_);
    Find(library, "fmi2Reset", &reset_);
    Find(library, "fmi2Terminate", &terminate_);
    Find(library, "fmi2DoStep", &step_);
    Find(library, "fmi2GetReal", &get_);
    Find(library, "fmi2SetReal", &set_);
    Find(library, "fmi2GetInteger", &get_integer_);
    Find(library, "fmi2GetBoolean", &get_boolean_);
    Find(library, "fmi2GetFMUstate", &save_);
    Find(library, "fmi2SetFMUstate", &restore_);
    Find(library, "fmi2FreeFMUstate", &free_state_);
    Find(library, "fmi2SerializedFMUstateSize", &size_);
    Find(library, "fmi2SerializeFMUstate", &serialize_);
    Find(library, "fmi2DeSerializeFMUstate", &deserialize_);
    component_ = instantiate(description.model_name.c_str(), fmi2CoSimulation,
                             description.token.c_str(), UriOf(resources).c_str(), &host_, 0, 0);
    if (component_ == nullptr) throw std::runtime_error("instantiate");
  }
  ~Calls2() override { free_(component_); }

  int Initialize(double start_time) override {
    fmi2Status status = setup_(component_, 0, 0, start_time, 0, 0);
    if (status == fmi2OK) status = enter_(component_);
    return status == fmi2OK ? exit_(component_) : status;
  }
  int Reset() override { return reset_(component_); }
  int Terminate() override { return terminate_(component_); }
  int Step(double time, double step) override { return step_(component_, time, step, 0); }
  int Get(std::span<const unsigned> references, std::span<double> values) override {
    return get_(component_, references.data(), references.size(), values.data());
  }
  int Set(std::span<const unsigned> references, std::span<const double> values) override {
    return set_(component_, references.data(), references.size(), values.data());
  }
  int GetInteger(unsigned reference, std::int32_t* value) override {
    return get_integer_(component_, &reference, 1, value);
  }
  int GetBoolean(unsigned reference, bool* value) override {
    int got = 0;
    const fmi2Status status = get_boolean_(component_, &reference, 1, &got);
    *value = got != 0;
    return status;
  }
  int SaveState(void** state) override { return save_(component_, state); }
  int RestoreState(void* state) override { return restore_(component_, state); }
  int FreeState(void** state) override { return free_state_(component_, state); }
  int Serialize(void* state, Bytes* bytes) override {
    std::size_t size = 0;
    const fmi2Status status = size_(component_, state, &size);
    if (status != fmi2OK) return status;
    bytes->resize(size);
    return serialize_(component_, state, reinterpret_cast<fmi2Byte*>(bytes->data()), size);
  }
  int Deserialize(std::span<const std::uint8_t> bytes, void** state) override {
    return deserialize_(component_, reinterpret_cast<const fmi2Byte*>(bytes.data()), bytes.size(),
                        state);
  }

 private:
  template <class... Arguments>
  using Call = fmi2Status (*)(fmi2Component, Arguments...);
  template <class T>
  using Access = Call<const fmi2ValueReference*, std::size_t, T*>;

  fmi2CallbackFunctions host_;  // the FMU may keep a pointer to it
  fmi2Component component_ = nullptr;
  void (*free_)(fmi2Component);
  Call<int, double, double, int, double> setup_;
  Call<> enter_, exit_, reset_, terminate_;
  Call<double, double, int> step_;
  Access<double> get_;
  Access<const double> set_;
  Access<int> get_integer_, get_boolean_;
  Call<fmi2FMUstate*> save_, free_state_;
  Call<fmi2FMUstate> restore_;
  Call<fmi2FMUstate, std::size_t*> size_;
  Call<fmi2FMUstate, fmi2Byte*, std::size_t> serialize_;
  Call<const fmi2Byte*, std::size_t, fmi2FMUstate*> deserialize_;
};

}  // namespace

std::unique_ptr<Calls> MakeCalls2(void* library, const Description& description,
                                  const std::filesystem::path& resources,
                                  std::vector<std::string>* messages) {
  return std::make_unique<Calls2>(library, description, resources, messages);
}

}  // namespace grouser::fmi
