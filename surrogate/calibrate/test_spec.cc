// The kinds of tests and what each has.
#include "surrogate/calibrate/test_spec.h"

#include <fmt/format.h>

#include <stdexcept>

#include "proto/records/yaml/nearest.h"

namespace grouser::surrogate {
namespace {

using enum Dimension;
constexpr QuantityField kPlate[] = {{"sinkage", kLength},    {"pressure", kPressure, true},
                                    {"force", kForce, true}, {"diameter", kLength},
                                    {"width", kLength},      {"length", kLength}};
constexpr QuantityField kPress[] = {
    {"sinkage", kLength}, {"force", kForce, true}, {"radius", kLength}, {"width", kLength}};
constexpr QuantityField kShear[] = {{"displacement", kLength},  {"rotation", kAngle},
                                    {"pressure", kPressure},    {"load", kForce},
                                    {"shear", kPressure, true}, {"force", kForce, true},
                                    {"torque", kMoment, true},  {"area", kArea},
                                    {"inner_radius", kLength},  {"outer_radius", kLength}};
constexpr QuantityField kWheel[] = {{"slip", kNone},        {"attack_angle", kAngle},
                                    {"rim_speed", kSpeed},  {"travel_speed", kSpeed},
                                    {"load", kForce},       {"f_x", kForce, true},
                                    {"f_y", kForce, true},  {"torque", kMoment, true},
                                    {"m_z", kMoment, true}, {"sinkage", kLength, true},
                                    {"radius", kLength},    {"width", kLength},
                                    {"repeats", kNone}};

}  // namespace

const char* NameOf(TestKind kind) {
  switch (kind) {
    case TestKind::kPlate:
      return "plate";
    case TestKind::kShear:
      return "shear";
    case TestKind::kPress:
      return "press";
    case TestKind::kWheel:
      break;
  }
  return "wheel";
}

TestKind ParseKind(const std::string& word, const std::string& place) {
  for (const TestKind kind :
       {TestKind::kPlate, TestKind::kShear, TestKind::kPress, TestKind::kWheel}) {
    if (word == NameOf(kind)) return kind;
  }
  throw std::invalid_argument(
      fmt::format("{}: kind '{}', expected plate, shear, press or wheel", place, word));
}

std::span<const QuantityField> QuantitiesOf(TestKind kind) {
  switch (kind) {
    case TestKind::kPlate:
      return kPlate;
    case TestKind::kShear:
      return kShear;
    case TestKind::kPress:
      return kPress;
    case TestKind::kWheel:
      break;
  }
  return kWheel;
}

const QuantityField& FindQuantity(TestKind kind, const std::string& name,
                                  const std::string& place) {
  std::vector<std::string> names;
  for (const QuantityField& field : QuantitiesOf(kind)) {
    if (name == field.name || (field.measured && name == std::string(field.name) + "_sd")) {
      return field;
    }
    names.push_back(field.name);
  }
  throw std::invalid_argument(
      fmt::format("{}: '{}' is nothing that a {} test has, expected one of: {} (and NAME_sd); the "
                  "nearest is '{}'",
                  place, name, NameOf(kind), fmt::join(names, ", "),
                  records::NearestOf(name.substr(0, 100), names)));
}

std::string QuantityOfColumn(TestKind kind, const std::string& column) {
  for (const QuantityField& field : QuantitiesOf(kind)) {
    const std::string name = field.name;
    if (!column.starts_with(name)) continue;
    const std::string end = column.substr(name.size());
    if (end == "_sd" && field.measured) return column;
    if (end.empty() && field.dimension == kNone) return name;
    const auto unit = UnitOfEnd(end);
    if (unit && unit->dimension == field.dimension) return name;
  }
  return "";
}

}  // namespace grouser::surrogate
