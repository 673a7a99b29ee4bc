// The model through every branch: on fine lines across slip, attack angle and
// load no output may jump.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>
#include <vector>

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

constexpr int kSteps = 1500, kFiner = 16;

// The model's answers at places of a line.
Batch At(const BekkerModel& model, const Line& line, const std::vector<double>& t) {
  Batch b;
  for (const double each : t) {
    const auto s = line.at(each);
    b.Add(s[0], s[1], s[2], s[3]);
  }
  b.Solve(model);
  return b;
}

// Change of output o to the state i from the one before, over its scale.
double Change(const BekkerModel& model, const Batch& b, int o, std::size_t i) {
  const double load = std::max(b.load[i], b.load[i - 1]);
  return (b.value[o][i] - b.value[o][i - 1]) / Scale(o, load, model.wheel().radius_m);
}

// The steps of the line where a jump can be: of each output those of the largest change,
// and those whose change differs most from a neighbour's.
std::set<int> Suspects(const BekkerModel& model, const Batch& b) {
  constexpr int kSuspects = 8;
  std::set<int> suspects;
  std::vector<double> change(kSteps + 2, 0.0);
  const auto choose = [&](const std::function<double(int)>& size) {
    std::vector<int> steps(kSteps);
    std::iota(steps.begin(), steps.end(), 1);
    std::partial_sort(steps.begin(), steps.begin() + kSuspects, steps.end(),
                      [&](int i, int k) { return size(i) > size(k); });
    suspects.insert(steps.begin(), steps.begin() + kSuspects);
  };
  for (int o = 0; o < kOutputs; ++o) {
    for (int i = 1; i <= kSteps; ++i) change[i] = Change(model, b, o, i);
    change[0] = change[1];
    change[kSteps + 1] = change[kSteps];
    choose([&](int i) { return std::fabs(change[i]); });
    choose([&](int i) {
      return std::max(std::fabs(change[i] - change[i - 1]), std::fabs(change[i + 1] - change[i]));
    });
  }
  return suspects;
}

// Sixteen times finer steps there: a jump would stay, a slope shrinks in proportion.
// A corner or a steep flank first seen by the finer scan is allowed a quarter.
void ExpectContinuous(const Line& line) {
  int number = 0;
  for (const BekkerParameters& soil : Soils()) {
    const BekkerModel model(soil, kWheel);
    std::vector<double> t(kSteps + 1), inside;
    for (int i = 0; i <= kSteps; ++i) t[i] = static_cast<double>(i) / kSteps;
    const Batch coarse = At(model, line, t);
    for (const int step : Suspects(model, coarse)) {
      for (int k = 0; k <= kFiner; ++k) {
        inside.push_back((step - 1 + static_cast<double>(k) / kFiner) / kSteps);
      }
    }
    const Batch fine = At(model, line, inside);
    double most = 0, most_fine = 0, where = 0;
    for (int o = 0; o < kOutputs; ++o) {
      for (int i = 1; i <= kSteps; ++i) {
        most = std::max(most, std::fabs(Change(model, coarse, o, i)));
      }
      for (std::size_t i = 1; i < inside.size(); ++i) {
        if (i % (kFiner + 1) == 0) continue;  // of another step
        const double change = std::fabs(Change(model, fine, o, i));
        if (change > most_fine) where = inside[i];
        most_fine = std::max(most_fine, change);
      }
    }
    EXPECT_LT(most_fine, most / 4 + 1e-6)
        << line.name << " soil " << number << ": " << most << ", " << most_fine << " at " << where;
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
