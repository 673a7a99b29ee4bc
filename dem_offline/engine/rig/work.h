#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

// What may be asked of an experiment: errors that name a field, and how much
// work is accepted. Checked before anything is allocated.

namespace grouser::dem {

/// A field of a spec that cannot be, as "field: got, expected ...".
class SpecError : public std::invalid_argument {
 public:
  SpecError(const std::string& field, const std::string& got, const std::string& expected)
      : std::invalid_argument(field + ": " + got + ", expected " + expected),
        field_(field),
        got_(got),
        expected_(expected) {}
  const std::string& field() const { return field_; }  ///< as in scene files, e.g. "wheel.radius_m"
  const std::string& got() const { return got_; }
  const std::string& expected() const { return expected_; }

 private:
  std::string field_, got_, expected_;
};

/// "%.6g".
std::string Short(double value);
/// Throw SpecError unless finite and > 0, or in [low, high].
void CheckPositive(const std::string& field, double value);
void CheckWithin(const std::string& field, double value, double low, double high);

/// Work of an experiment, as an upper bound.
struct Work {
  double grains = 0;
  double steps = 0;
  double bytes = 0;  ///< of memory
};

/// How much is accepted. The defaults refuse what cannot end on one machine: 1e13
/// grain-steps are a week of one core.
struct WorkLimits {
  double bytes = 0;  ///< 0: MemoryShare of what is available now
  double steps = 1e9;
  double grain_steps = 1e13;
};
inline constexpr double kMemoryShare = 0.8;  ///< of the available memory, by default

/// Grains have 32-bit numbers, and so have their contacts.
inline constexpr double kMostGrains = 1e8;
/// Memory of a world by the grain: lists, histories, and the copies of the states that
/// open it. Measured: 2.1 kB for a dense bed of 60,000 grains.
inline constexpr double kBytesPerGrain = 4000;

/// Bytes that may be used: as said, or kMemoryShare of MemAvailable of this
/// machine, or of the limit of its control group where that is less.
double MostBytes(const WorkLimits& limits);
/// Throws SpecError naming `field` with what is needed and what is accepted.
void CheckWork(const std::string& field, const Work& work, const WorkLimits& limits);

/// Steps between two looks at the caller: a fraction of a second on one core.
std::int64_t PollSteps(std::int64_t grains);

}  // namespace grouser::dem
