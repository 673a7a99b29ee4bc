#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "surrogate/models/bekker.h"
#include "surrogate/soils/soil_table.h"

namespace grouser::surrogate {

/// Kinds of tests: a plate pressed down; direct shear, or a ring turned, under a load; a wheel
/// pressed down without turning; a wheel test at a steady state.
enum class TestKind { kPlate, kShear, kPress, kWheel };
const char* NameOf(TestKind kind);

/// One measured number, SI, and the condition that it was measured at. What a kind does not
/// have stays 0.
struct Observation {
  int test = 0;  ///< index in MeasuredSoil::tests
  int line = 0;  ///< of its file
  bool held_out = false;
  int output = -1;   ///< of a wheel: Output; else -1
  double value = 0;  ///< plate: pressure [Pa]; shear: stress [Pa]; press: force [N]; wheel: output
  double sd = std::numeric_limits<double>::quiet_NaN();  ///< NaN: not stated
  double sinkage = 0;                                    ///< plate, press [m]
  double width = 0;         ///< plate: b, the radius of a disc or the lesser side [m]
  double pressure = 0;      ///< shear: normal [Pa]
  double displacement = 0;  ///< shear [m]
  VelocityState motion{};   ///< wheel
  double slip = 0, attack_angle = 0;
  double load = 0;  ///< wheel [N]
};

struct MeasuredTest {
  std::string name, file, sha256;
  TestKind kind = TestKind::kPlate;
  WheelGeometry wheel{};  ///< press, wheel
  /// How many independent observations the fitted ones count as (neighbours on one curve share
  /// their grains and their rig); none: each for itself.
  std::optional<double> counts_as;
  bool disc = true;  ///< of a plate: else a rectangle
};

/// All that was measured on one soil.
struct MeasuredSoil {
  std::string name = "soil", source;
  std::optional<SoilKind> kind;             ///< chooses what is typical; none: any soil
  std::optional<double> density_kg_per_m3;  ///< bulk
  double gravity = 9.81;
  std::vector<MeasuredTest> tests;
  std::vector<Observation> observations;
  std::vector<std::string> notes;                 ///< what was left out or looks odd, in words
  std::vector<std::array<std::string, 2>> files;  ///< file and SHA-256, measurement files too
};

}  // namespace grouser::surrogate
