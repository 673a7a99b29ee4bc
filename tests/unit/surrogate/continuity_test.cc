// The model through every branch: on fine lines across slip, attack angle and
// load no output may jump.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/unit/surrogate/hard_cases.h"
#include "tests/unit/surrogate/small_wheel.h"

namespace grouser::surrogate {
namespace {

using hard_cases::Batch;
using hard_cases::Scale;
using hard_cases::Soils;

// A line through the space of states, at t in [0, 1].
struct Line {
  const char* name;
  std::function<std::array<double, 4>(double)> at;  // v_x, v_y, rim speed, load
};

// Largest change of any output between neighbours, over its scale.
double LargestJump(const BekkerModel& model, const Line& line, int steps, double* where) {
  Batch b;
  for (int i = 0; i <= steps; ++i) {
    const auto s = line.at(static_cast<double>(i) / steps);
    b.Add(s[0], s[1], s[2], s[3]);
  }
  b.Solve(model);
  double largest = 0;
  for (int o = 0; o < kOutputs; ++o) {
    for (int i = 1; i <= steps; ++i) {
      const double load = std::max(b.load[i], b.load[i - 1]);
      const double jump =
          std::fabs(b.value[o][i] - b.value[o][i - 1]) / Scale(o, load, model.wheel().radius_m);
      if (jump > largest) {
        largest = jump;
        *where = (i - 0.5) / steps;
      }
    }
  }
  return largest;
}

// Sixteen times finer steps: a jump would stay, a slope shrinks in proportion.
// A corner or a steep flank first seen by the finer scan is allowed a quarter.
void ExpectContinuous(const Line& line) {
  int number = 0;
  for (const BekkerParameters& soil : Soils()) {
    const BekkerModel model(soil, kWheel);
    double at_coarse = 0, at_fine = 0;
    const double coarse = LargestJump(model, line, 1500, &at_coarse);
    const double fine = LargestJump(model, line, 16 * 1500, &at_fine);
    EXPECT_LT(fine, coarse / 4 + 1e-6) << line.name << " soil " << number << ": " << coarse
                                       << " at " << at_coarse << ", " << fine << " at " << at_fine;
    ++number;
  }
}

TEST(HardCases, ContinuousThroughSlipZeroAndFullSlips) {
  for (const double y : {0.0, 1e-4, 0.05, 0.5, 2.0}) {
    // Once round: slip 0, 1, -2 (both senses), -1.
    ExpectContinuous({"all slips", [y](double t) -> std::array<double, 4> {
                        return {std::cos(2 * kPi * t), y, std::sin(2 * kPi * t), 24};
                      }});
    ExpectContinuous({"slip 0", [y](double t) -> std::array<double, 4> {
                        return {1, y, 1 + 2e-3 * (t - 0.5), 24};
                      }});
    ExpectContinuous({"slip 1", [y](double t) -> std::array<double, 4> {
                        return {2e-3 * (t - 0.5), y, 1, 24};
                      }});
    ExpectContinuous({"slip -1", [y](double t) -> std::array<double, 4> {
                        return {1, y, 2e-3 * (t - 0.5), 24};
                      }});
    ExpectContinuous({"slip -2", [y](double t) -> std::array<double, 4> {
                        return {1, y, -1 + 2e-3 * (t - 0.5), 24};
                      }});
  }
}

TEST(HardCases, ContinuousThroughStraightSidewaysAndReversing) {
  for (const double u : {-1.5, -0.5, -1e-3, 0.0, 1e-3, 0.5, 1.0, 1.5}) {
    ExpectContinuous({"all attack angles", [u](double t) -> std::array<double, 4> {
                        return {std::cos(2 * kPi * t), std::sin(2 * kPi * t), u, 24};
                      }});
    ExpectContinuous({"beta 0", [u](double t) -> std::array<double, 4> {
                        return {1, 2e-3 * (t - 0.5), u, 24};
                      }});
    ExpectContinuous({"beta 90", [u](double t) -> std::array<double, 4> {
                        return {2e-3 * (t - 0.5), 1, u, 24};
                      }});
    ExpectContinuous({"beta 180", [u](double t) -> std::array<double, 4> {
                        return {-1, 2e-3 * (t - 0.5), u, 24};
                      }});
  }
  // Sideways while the spin turns round.
  ExpectContinuous({"spin through 0", [](double t) -> std::array<double, 4> {
                      return {0, 1, 2e-3 * (t - 0.5), 24};
                    }});
}

TEST(HardCases, ContinuousInTheLoadFromNothingToOverload) {
  const std::array<std::array<double, 3>, 6> motions = {
      {{1, 0, 1.3}, {1, 0, 0.4}, {1, 0, -1}, {0, 1, 0.2}, {1, 1, 0}, {-1, 0.3, 0.5}}};
  for (const auto& m : motions) {
    ExpectContinuous({"load", [&m](double t) -> std::array<double, 4> {
                        return {m[0], m[1], m[2], std::pow(10, -9 + 14 * t)};
                      }});
  }
}

}  // namespace
}  // namespace grouser::surrogate
