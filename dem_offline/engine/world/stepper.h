#pragma once

#include <cstdint>
#include <stdexcept>

namespace grouser::dem {

class World;
enum class StepFault : int;

/// Makes the steps of a World somewhere else than on this machine's cores.
class Stepper {
 public:
  virtual ~Stepper() = default;
  /// Throws NotElsewhere for what it can not do, before anything has changed.
  virtual StepFault Run(World& world, std::int64_t steps) = 0;
};

/// What a back end refuses, by name.
struct NotElsewhere : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

}  // namespace grouser::dem
