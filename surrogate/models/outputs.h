#pragma once

#include <cstdint>

/// What a model answers, said once: order, names, units, scales and parities of
/// the outputs, their parts, and the flags. Plain arrays and always inlined
/// functions, so that a file compiled for a wide instruction set may include it
/// and leaves no copy of a function behind.
///
/// The wire (proto/grouser/v1alpha1/state.proto) and the public header
/// (clients/in_process/grouser/model.h) have to repeat order and flags; both are
/// asserted equal to this file where they are translated.
namespace grouser::surrogate {

/// Outputs, in the order used everywhere.
enum Output : int { kFx = 0, kFy, kFz, kTorque, kMz, kSinkage };
inline constexpr int kOutputs = 6;

/// What counts as 1 when an output is compared: load, load r, or r.
enum class OutputUnit { kLoad, kLoadRadius, kRadius };

struct OutputField {
  const char* name;  ///< in files, JSON and on the command line
  const char* unit;  ///< SI
  OutputUnit scale;
  int parity_x;  ///< sign under the mirror in x (v_x and rim speed)
  int parity_y;  ///< sign under the mirror in y (v_y)
};
inline constexpr OutputField kOutputFields[kOutputs] = {
    {"f_x", "N", OutputUnit::kLoad, -1, 1},
    {"f_y", "N", OutputUnit::kLoad, 1, -1},
    {"f_z", "N", OutputUnit::kLoad, 1, 1},
    {"torque", "N m", OutputUnit::kLoadRadius, -1, 1},
    {"m_z", "N m", OutputUnit::kLoadRadius, -1, -1},
    {"sinkage", "m", OutputUnit::kRadius, 1, 1},
};

/// What a model has to find: f_z is the load.
inline constexpr Output kPredicted[] = {kFx, kFy, kTorque, kMz, kSinkage};
/// What a testbed measures, too.
inline constexpr Output kMeasurable[] = {kFx, kFy, kTorque, kSinkage};

[[gnu::always_inline]] constexpr bool IsMoment(int output) {
  return kOutputFields[output].scale == OutputUnit::kLoadRadius;
}
/// The scale of an output as a number: deviations over it are comparable.
[[gnu::always_inline]] constexpr double OutputScale(int output, double load, double radius) {
  if (kOutputFields[output].scale == OutputUnit::kRadius) return radius;
  return IsMoment(output) ? load * radius : load;
}

/// Parts of an output's answer. kDvX to kDLoad: derivatives of the value with
/// respect to v_x, v_y, rim speed [unit s/m] and load [unit/N].
enum Part : int { kValue = 0, kSdFit, kSdPatch, kLow, kHigh, kDvX, kDvY, kDRim, kDLoad };
inline constexpr int kParts = 9;

/// Two-sided 90 % of a normal distribution.
inline constexpr double kTwoSided90 = 1.6448536269514722;

/// Flags of a state, bits. 0: nothing to say.
enum Flag : std::uint32_t {
  kInvalid = 1,         ///< non-finite or impossible input; NaN out
  kClamped = 2,         ///< something was clamped to the model's limits
  kExtrapolated = 4,    ///< outside what the training runs covered
  kStatic = 8,          ///< V = r w = 0
  kNoEquilibrium = 16,  ///< the soil does not carry the load
  kRate = 32,           ///< faster than the quasi-static range
  /// A slope was given, the model has none; NaN out. But of a wheel in a vehicle's solution
  /// (vehicle/solver.h): finite forces, by the model of level ground at the load across the slope.
  kSlope = 64,
  kVirginAssumed = 256,    ///< pass > 1 given, the model has none; NaN out
  kFormUnknown = 512,      ///< not compared with a measurement here
  kToleranceUnmet = 1024,  ///< no model suffices, or the budget ended
  kAirborne = 2048,        ///< load 0, a wheel off the ground: every output is exactly 0
  kUntuned = 4096,         ///< the model was not fitted to this wheel on this soil
};
/// Questions that a model has no answer to: every part is NaN.
inline constexpr std::uint32_t kNotAnswered = kSlope | kVirginAssumed;
struct FlagField {
  Flag flag;
  const char* name;
};
inline constexpr FlagField kFlagFields[] = {
    {kInvalid, "INVALID"},
    {kClamped, "CLAMPED"},
    {kExtrapolated, "EXTRAPOLATED"},
    {kStatic, "STATIC"},
    {kNoEquilibrium, "NO_EQUILIBRIUM"},
    {kRate, "RATE"},
    {kSlope, "SLOPE"},
    {kVirginAssumed, "VIRGIN_ASSUMED"},
    {kFormUnknown, "FORM_UNKNOWN"},
    {kToleranceUnmet, "TOLERANCE_UNMET"},
    {kAirborne, "AIRBORNE"},
    {kUntuned, "UNTUNED"},
};

}  // namespace grouser::surrogate
