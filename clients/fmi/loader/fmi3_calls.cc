#include "clients/fmi/fmi_types.h"
#include "clients/fmi/loader/calls.h"

namespace grouser::fmi {
namespace {

void NoteOf3(fmi3InstanceEnvironment to, fmi3Status, fmi3String, fmi3String message) {
  static_cast<std::vector<std::string>*>(to)->emplace_back(message);
}

class Calls3 final : public Calls {
 public:
  Calls3(void* library, const Description& description, const std::filesystem::path& resources,
         std::vector<std::string>* messages) {
    fmi3Instance (*instantiate)(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean,
                                fmi3Boolean, fmi3Boolean, const fmi3ValueReference*, std::size_t,
                                fmi3InstanceEnvironment, fmi3LogMessageCallback,
                                fmi3IntermediateUpdateCallback);
    Find(library, "fmi3InstantiateCoSimulation", &instantiate);
    Find(library, "fmi3FreeInstance", &free_);
    Find(library, "fmi3EnterInitializationMode", &enter_);
    Find(library, "fmi3ExitInitializationMode", &exit_);
    Find(library, "fmi3Reset", &reset_);
    Find(library, "fmi3Terminate", &terminate_);
    Find(library, "fmi3DoStep", &step_);
    Find(library, "fmi3GetFloat64", &get_);
    Find(library, "fmi3SetFloat64", &set_);
    Find(library, "fmi3GetInt32", &get_integer_);
    Find(library, "fmi3GetBoolean", &get_boolean_);
    Find(library, "fmi3GetFMUState", &save_);
    Find(library, "fmi3SetFMUState", &restore_);
    Find(library, "fmi3FreeFMUState", &free_state_);
    Find(library, "fmi3SerializedFMUStateSize", &size_);
    Find(library, "fmi3SerializeFMUState", &serialize_);
    Find(library, "fmi3DeserializeFMUState", &deserialize_);
    // The standard: an absolute path that ends with a separator.
    const std::string folder = std::filesystem::absolute(resources).string() + "/";
    instance_ =
        instantiate(description.model_name.c_str(), description.token.c_str(), folder.c_str(),
                    false, false, false, false, nullptr, 0, messages, NoteOf3, nullptr);
    if (instance_ == nullptr) throw std::runtime_error("instantiate");
  }
  ~Calls3() override { free_(instance_); }

  int Initialize(double start_time) override {
    const fmi3Status status = enter_(instance_, false, 0, start_time, false, 0);
    return status == fmi3OK ? exit_(instance_) : status;
  }
  int Reset() override { return reset_(instance_); }
  int Terminate() override { return terminate_(instance_); }
  int Step(double time, double step) override {
    bool event = false, terminate = false, early = false;
    double last = 0;
    return step_(instance_, time, step, false, &event, &terminate, &early, &last);
  }
  int Get(std::span<const unsigned> references, std::span<double> values) override {
    return get_(instance_, references.data(), references.size(), values.data(), values.size());
  }
  int Set(std::span<const unsigned> references, std::span<const double> values) override {
    return set_(instance_, references.data(), references.size(), values.data(), values.size());
  }
  int GetInteger(unsigned reference, std::int32_t* value) override {
    return get_integer_(instance_, &reference, 1, value, 1);
  }
  int GetBoolean(unsigned reference, bool* value) override {
    return get_boolean_(instance_, &reference, 1, value, 1);
  }
  int SaveState(void** state) override { return save_(instance_, state); }
  int RestoreState(void* state) override { return restore_(instance_, state); }
  int FreeState(void** state) override { return free_state_(instance_, state); }
  int Serialize(void* state, Bytes* bytes) override {
    std::size_t size = 0;
    const fmi3Status status = size_(instance_, state, &size);
    if (status != fmi3OK) return status;
    bytes->resize(size);
    return serialize_(instance_, state, bytes->data(), size);
  }
  int Deserialize(std::span<const std::uint8_t> bytes, void** state) override {
    return deserialize_(instance_, bytes.data(), bytes.size(), state);
  }

 private:
  template <class... Arguments>
  using Call = fmi3Status (*)(fmi3Instance, Arguments...);
  template <class T>
  using Access = Call<const fmi3ValueReference*, std::size_t, T*, std::size_t>;

  fmi3Instance instance_ = nullptr;
  void (*free_)(fmi3Instance);
  Call<bool, double, double, bool, double> enter_;
  Call<> exit_, reset_, terminate_;
  Call<double, double, bool, bool*, bool*, bool*, double*> step_;
  Access<double> get_;
  Access<const double> set_;
  Access<std::int32_t> get_integer_;
  Access<bool> get_boolean_;
  Call<fmi3FMUState*> save_, free_state_;
  Call<fmi3FMUState> restore_;
  Call<fmi3FMUState, std::size_t*> size_;
  Call<fmi3FMUState, fmi3Byte*, std::size_t> serialize_;
  Call<const fmi3Byte*, std::size_t, fmi3FMUState*> deserialize_;
};

}  // namespace

std::unique_ptr<Calls> MakeCalls3(void* library, const Description& description,
                                  const std::filesystem::path& resources,
                                  std::vector<std::string>* messages) {
  return std::make_unique<Calls3>(library, description, resources, messages);
}

}  // namespace grouser::fmi
