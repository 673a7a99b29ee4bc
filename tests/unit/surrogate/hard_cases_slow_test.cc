#include <gtest/gtest.h>

#include "tests/unit/surrogate/hard_cases.h"

namespace grouser::surrogate {
namespace {

TEST(HardCases, TenMillionRandomInputsWithoutAFailedSolve) {
  hard_cases::SolveRandomInputs(10'000'000, 12);
}

}  // namespace
}  // namespace grouser::surrogate
