#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "surrogate/models/bekker.h"

namespace grouser::surrogate::hard_cases {

/// States as SolveBatch takes them, and its answers.
struct Batch {
  std::vector<double> v_x, v_y, rim, load;
  std::array<std::vector<double>, kOutputs> value;
  std::array<std::array<std::vector<double>, kInputs>, kOutputs> gradient;
  std::vector<std::uint8_t> no_equilibrium;

  std::size_t size() const { return load.size(); }
  void Add(double x, double y, double u, double w);
  void Solve(const BekkerModel& model, bool gradients = false);
};

/// What counts as 1 when an output is compared: load, load r, or r.
double Scale(int output, double load, double radius);

/// The default soil with one parameter changed; a purely cohesive soil; a
/// handful that between them take every branch.
BekkerParameters With(double BekkerParameters::*member, double value);
BekkerParameters Clay();
std::vector<BekkerParameters> Soils();

/// Any soil and wheel that the model accepts within what the field knows.
BekkerModel RandomModel(std::mt19937_64* random);

/// Solves about `count` random valid states of random models and fails the
/// running test unless every one is finite and balanced to 1e-9 or flagged.
void SolveRandomInputs(long count, std::uint64_t seed);

}  // namespace grouser::surrogate::hard_cases
