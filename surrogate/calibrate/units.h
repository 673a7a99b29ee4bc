#pragma once

#include <optional>
#include <string>

namespace grouser::surrogate {

/// What a measured quantity is measured in.
enum class Dimension { kLength, kArea, kForce, kPressure, kMoment, kAngle, kSpeed, kNone };

struct Unit {
  std::string name;
  Dimension dimension;
  double si;  ///< of one unit; angles in radians
};

/// A unit by name ("mm", "kPa", "N m", "deg", "1", "%"); none: unknown.
std::optional<Unit> FindUnit(const std::string& name);
/// The unit that the end of a column's name states: "sinkage_mm", "speed_m_per_s", "p [kPa]".
std::optional<Unit> UnitOfColumn(const std::string& column);
/// The unit that all of such an end names: "_mm", " [kPa]", "(N)".
std::optional<Unit> UnitOfEnd(const std::string& end);
/// The SI unit of a dimension, and all units that it may be given in.
std::string SiUnit(Dimension dimension);
std::string UnitsOf(Dimension dimension);

/// "60 mm", "0.2", "5 kPa" -> SI. A number without a unit counts as SI. Throws
/// std::invalid_argument "got '...', expected ...".
double ParseQuantity(const std::string& text, Dimension dimension);
/// The whole text as a finite number; none where it is not one.
std::optional<double> ParseNumber(const std::string& text);

}  // namespace grouser::surrogate
