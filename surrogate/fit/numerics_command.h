#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "surrogate/fit/numerics_report.h"

namespace grouser::surrogate {

/// grouser-fit numerics: a model beside the numeric laws of traction.
struct NumericsArguments {
  std::string model;
  std::vector<std::string> cones;  ///< further tables of cone indices
  std::optional<double> index_kpa, gradient_kpa_per_m;
  NumericsRequest request;
};

void AddNumericsOptions(CLI::App* sub, NumericsArguments* a);
/// What is printed. Throws as CompareWithNumerics, for hard ground and for what cannot be read.
std::string NumericsOf(const NumericsArguments& a, bool json);

}  // namespace grouser::surrogate
