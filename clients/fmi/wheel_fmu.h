#pragma once

#include <array>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "grouser/contact.h"
#include "grouser/model.h"
#include "variables.h"

/// A wheel on soil as FMI sees it: variables by value reference, steps, states. Versions 2 and 3 of
/// the standard call the same object (fmi2.cc, fmi3.cc). The physics is grouser::WheelContact.
namespace grouser::fmi {

/// An instance of the FMU. Its functions throw std::exception with what, where and what was
/// expected; the instance then is as it was before the call.
class WheelFmu {
 public:
  /// `resources`: folder with wheel.model and parameters.csv ("name,start value" a line). `token`:
  /// instantiationToken (guid) of the modelDescription.xml that the host read.
  WheelFmu(const std::filesystem::path& resources, const std::string& token);

  /// Keeps the start time; any number of times before the initialisation.
  void SetUp(double start_time);
  void EnterInitialization(double start_time);
  void ExitInitialization();
  void Terminate();
  /// As just made.
  void Reset();

  /// Values of variables of one type; as many values as references.
  template <class T>
  void Get(Type type, std::span<const unsigned> references, std::span<T> values) {
    CheckSizes(references.size(), values.size());
    if (now_.mode == Mode::kInitialization) Calculate(0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<T>(Value(type, references[i]));
    }
  }
  /// Inputs, and parameters before the end of initialisation; finite numbers. All or none.
  void Set(std::span<const unsigned> references, std::span<const double> values);

  /// From `time` on by `step` >= 0 [s], inputs constant: the outputs are those at its end.
  void DoStep(double time, double step);
  double time() const { return now_.value[at::kTime]; }

  enum class Mode : std::int64_t { kInstantiated, kInitialization, kStep, kTerminated };
  /// All that a step depends on but the model: a plain value without padding.
  struct State {
    std::array<double, kVariables> value;
    ContactState contact;
    Mode mode;
    std::int64_t set_up;  // 1: by SetUp
  };
  const State& state() const { return now_; }
  void SetState(const State& state);

  /// A state as bytes, for the same model and this build of the library. Refused: bytes of another
  /// model or table of variables, damaged ones, and values that no state of this FMU has.
  std::vector<std::uint8_t> Serialize(const State& state) const;
  State Deserialize(std::span<const std::uint8_t> bytes) const;

 private:
  void CheckState(const State& state) const;
  static void CheckSizes(std::size_t references, std::size_t values);
  double Value(Type type, unsigned reference) const;
  void RequireMode(Mode mode, const char* call) const;
  ContactOptions Options() const;
  // Outputs at the inputs, `step` after the last ones.
  void Calculate(double step);
  void WriteContact(const WheelForce& force);
  void WriteHalfWidths(const WheelForce& force);

  std::unique_ptr<const Model> model_;
  State start_{}, now_{};
  ContactOptions made_with_;
  std::unique_ptr<WheelContact> contact_;
};

/// Throws std::invalid_argument "WHAT: got GOT, expected EXPECTED".
[[noreturn]] void Refuse(const std::string& what, double got, const std::string& expected);

/// What a host gave. Throws where it gave none.
template <class T>
T* Given(T* pointer, const char* what) {
  if (pointer == nullptr) throw std::invalid_argument(std::string(what) + ": none was given");
  return pointer;
}
template <class T>
std::span<T> Given(T* first, std::size_t count, const char* what) {
  return {count == 0 ? first : Given(first, what), count};
}

/// The calls of both versions that save and restore; states are WheelFmu::State on the heap, and
/// made where *to is null. Throw as WheelFmu does, and where a pointer is null.
void SaveState(const WheelFmu& fmu, void** to);
void RestoreState(const void* from, WheelFmu* fmu);
void SerializedSize(const WheelFmu& fmu, const void* state, std::size_t* size);
void SerializeState(const WheelFmu& fmu, const void* state, void* to, std::size_t size);
void DeserializeState(const WheelFmu& fmu, const void* from, std::size_t size, void** to);

/// Answers a call of a host: `call`, or where it throws what `log` gets and an error status.
template <class Status, class Call, class Log>
Status Guarded(Status ok, Status error, const Log& log, const Call& call) {
  try {
    call();
    return ok;
  } catch (const std::exception& problem) {
    log(problem.what());
  } catch (...) {
    log("unknown error");
  }
  return error;
}

}  // namespace grouser::fmi
