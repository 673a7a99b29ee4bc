#include "surrogate/calibrate/units.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace grouser::surrogate {
namespace {

struct Known {
  const char *name, *column;  // as a unit; as the end of a column's name
  Dimension dimension;
  double si;
};
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kInch = 0.0254, kPoundForce = 4.4482216152605;
using enum Dimension;
// The first of a dimension is SI. "psi" before "si", longer ends before shorter ones.
constexpr std::array kUnits = {
    Known{"m/s", "m_per_s", kSpeed, 1},
    Known{"mm/s", "mm_per_s", kSpeed, 1e-3},
    Known{"mm/s", "mm_s", kSpeed, 1e-3},
    Known{"cm/s", "cm_per_s", kSpeed, 1e-2},
    Known{"m/s", "m_s", kSpeed, 1},
    Known{"N m", "n_m", kMoment, 1},
    Known{"N m", "nm", kMoment, 1},
    Known{"N mm", "n_mm", kMoment, 1e-3},
    Known{"kN m", "kn_m", kMoment, 1e3},
    Known{"m", "m", kLength, 1},
    Known{"mm", "mm", kLength, 1e-3},
    Known{"cm", "cm", kLength, 1e-2},
    Known{"in", "in", kLength, kInch},
    Known{"m^2", "m2", kArea, 1},
    Known{"mm^2", "mm2", kArea, 1e-6},
    Known{"cm^2", "cm2", kArea, 1e-4},
    Known{"N", "n", kForce, 1},
    Known{"kN", "kn", kForce, 1e3},
    Known{"lbf", "lbf", kForce, kPoundForce},
    Known{"Pa", "pa", kPressure, 1},
    Known{"kPa", "kpa", kPressure, 1e3},
    Known{"MPa", "mpa", kPressure, 1e6},
    Known{"psi", "psi", kPressure, kPoundForce / (kInch * kInch)},
    Known{"rad", "rad", kAngle, 1},
    Known{"deg", "deg", kAngle, kDegree},
    Known{"1", "ratio", kNone, 1},
    Known{"%", "percent", kNone, 0.01},
};

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

Unit Take(const Known& known) { return {known.name, known.dimension, known.si}; }

}  // namespace

std::optional<Unit> FindUnit(const std::string& name) {
  for (const Known& known : kUnits) {
    if (name == known.name) return Take(known);
  }
  return std::nullopt;
}

std::optional<Unit> UnitOfColumn(const std::string& column) {
  const auto open = column.find_last_of("[(");
  if (open != std::string::npos && column.size() > open + 2) {
    return FindUnit(column.substr(open + 1, column.size() - open - 2));
  }
  const std::string lower = Lower(column);
  std::optional<Unit> found;
  std::size_t longest = 0;
  for (const Known& known : kUnits) {
    const std::string end = std::string("_") + known.column;
    if (end.size() <= longest || !lower.ends_with(end)) continue;
    longest = end.size();
    found = Take(known);
  }
  return found;
}

std::optional<Unit> UnitOfEnd(const std::string& end) {
  const auto unit = UnitOfColumn(end);
  const bool bracket = end.ends_with(']') || end.ends_with(')');
  const auto begin = end.find_first_not_of(' ');
  if (bracket) return begin == end.find_last_of("[(") ? unit : std::nullopt;
  const auto whole = [&](const Known& known) {
    return Lower(end) == std::string("_") + known.column;
  };
  return std::ranges::any_of(kUnits, whole) ? unit : std::nullopt;
}

std::string SiUnit(Dimension dimension) {
  const auto first = std::ranges::find(kUnits, dimension, &Known::dimension);
  return first == kUnits.end() ? "1" : first->name;
}

std::string UnitsOf(Dimension dimension) {
  std::string all;
  for (const Known& known : kUnits) {
    const bool again = all.ends_with(std::string(known.name)) && !all.empty();
    if (known.dimension != dimension || again) continue;
    all += (all.empty() ? "" : ", ") + std::string(known.name);
  }
  return all;
}

std::optional<double> ParseNumber(const std::string& text) {
  double value = 0;
  const char *begin = text.data(), *end = begin + text.size();
  if (begin != end && *begin == '+') ++begin;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

double ParseQuantity(const std::string& text, Dimension dimension) {
  const auto stop = text.find_first_not_of("+-.0123456789eE");
  const auto number = ParseNumber(text.substr(0, stop));
  std::string rest = stop == std::string::npos ? "" : text.substr(stop);
  rest.erase(0, rest.find_first_not_of(' '));
  const auto unit = rest.empty() ? Unit{"", dimension, 1} : FindUnit(rest);
  if (!number || !unit || unit->dimension != dimension) {
    throw std::invalid_argument(fmt::format("got '{}', expected a number and one of the units {}",
                                            text, UnitsOf(dimension)));
  }
  return *number * unit->si;
}

}  // namespace grouser::surrogate
