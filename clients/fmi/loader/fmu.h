#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

/// An FMU in this process: a small importer for co-simulation, FMI 2.0 and 3.0, of Linux on x86-64.
/// It knows the standard alone, nothing of Grouser.
namespace grouser::fmi {

/// A variable as modelDescription.xml has it.
struct Entry {
  unsigned reference = 0;
  std::string type;  ///< as FMI 3.0 says: Float64, Int32, Boolean
  std::string causality, unit, start, description;
};

/// What modelDescription.xml says.
struct Description {
  int version = 0;  ///< of FMI: 2 or 3
  std::string model_name, identifier, token;
  bool saves_state = false, serializes_state = false;
  std::map<std::string, Entry> variables;  ///< by name
};

/// Throws std::runtime_error "FILE: cause".
Description ReadDescription(const std::filesystem::path& model_description);

using Bytes = std::vector<std::uint8_t>;

/// The functions of one version of the standard, on one instance. They return 0 where all is well.
class Calls {
 public:
  virtual ~Calls() = default;
  virtual int Initialize(double start_time) = 0;
  virtual int Reset() = 0;
  virtual int Terminate() = 0;
  virtual int Step(double time, double step) = 0;
  virtual int Get(std::span<const unsigned> references, std::span<double> values) = 0;
  virtual int Set(std::span<const unsigned> references, std::span<const double> values) = 0;
  virtual int GetInteger(unsigned reference, std::int32_t* value) = 0;
  virtual int GetBoolean(unsigned reference, bool* value) = 0;
  virtual int SaveState(void** state) = 0;
  virtual int RestoreState(void* state) = 0;
  virtual int FreeState(void** state) = 0;
  virtual int Serialize(void* state, Bytes* bytes) = 0;
  virtual int Deserialize(std::span<const std::uint8_t> bytes, void** state) = 0;
};

/// An FMU that was unpacked to a folder (say by `python3 -m zipfile -e wheel.fmu FOLDER`),
/// instantiated once. Functions throw std::runtime_error "call: last message of the FMU".
class Fmu {
 public:
  explicit Fmu(const std::filesystem::path& folder);
  Fmu(const Fmu&) = delete;
  Fmu& operator=(const Fmu&) = delete;
  ~Fmu();

  const Description& description() const { return description_; }
  /// Messages of the FMU so far.
  const std::vector<std::string>& messages() const { return messages_; }
  /// Throws for a name that is none of its.
  unsigned Reference(const std::string& name) const;
  /// Of NAME.x, NAME.y, NAME.z.
  std::vector<unsigned> References(const std::string& name) const;

  void Initialize(double start_time = 0);
  void Step(double time, double step);
  void Reset();
  void Terminate();
  void Set(const std::string& name, double value);
  double Get(const std::string& name) const;  ///< of any type, as a number
  void Set(std::span<const unsigned> references, std::span<const double> values);  ///< Float64
  void Get(std::span<const unsigned> references, std::span<double> values) const;  ///< Float64

  using State = std::shared_ptr<void>;  ///< not to outlive the FMU
  State Save() const;
  void Restore(const State& state);
  Bytes Serialize(const State& state) const;
  State Deserialize(std::span<const std::uint8_t> bytes) const;

 private:
  void Check(int status, const std::string& call) const;
  State Own(void* state) const;

  Description description_;
  std::vector<std::string> messages_;
  std::shared_ptr<void> library_;
  std::unique_ptr<Calls> calls_;
};

}  // namespace grouser::fmi
