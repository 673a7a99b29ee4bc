#pragma once

#include <span>
#include <string>

#include "clients/vehicle/answers.h"

namespace grouser::cli {

/// Whether a drive can be driven and its energy is known: no row has a reason but those that say
/// what the models' runs do not cover, and each balances at the mean ground and at both ends of the
/// interval. The one rule behind exit codes of `energy`.
bool IsGood(const vehicle::TrajectoryCost& cost);
/// The same of rows that follow one another.
bool AreGood(std::span<const vehicle::PowerInterval> powers);

/// Power of every row of a drive to stdout, the sum to stderr; of several drives a line each. True:
/// all are good; the last row of a drive with times lasts for no time and does not count. Throws
/// InputError as ReadMotionLog and StepsOf, and what `answers` throws. `soil`: where a drive names
/// none; empty: the first.
bool PrintEnergies(VehicleAnswers* answers, std::span<const std::string> drives,
                   const std::string& soil, bool json);

}  // namespace grouser::cli
