#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "surrogate/calibrate/measurement.h"
#include "surrogate/calibrate/units.h"

namespace grouser::surrogate {

/// What a column or a constant of a kind of test may hold.
struct QuantityField {
  const char* name;
  Dimension dimension;
  bool measured = false;  ///< has a standard deviation: column NAME_sd, key sd
};
std::span<const QuantityField> QuantitiesOf(TestKind kind);

struct ColumnSpec {
  std::string column;
  std::string unit;  ///< empty: as the column's name says
  double sign = 1;
};

/// A standard deviation for rows without one.
struct SdSpec {
  double value = 0;
  bool relative = false;  ///< times the measured value
};

/// Rows by line of their file or by what stands in a column.
struct LineChoice {
  std::set<int> lines;
  std::map<std::string, std::vector<std::string>> texts;  ///< column -> any of these
  bool all = false;
};

/// How one test is read from a CSV.
struct TestSpec {
  std::string place;  ///< "FILE:LINE: tests[0]" or "--columns", for messages
  std::string name, file;
  TestKind kind = TestKind::kPlate;
  std::map<std::string, ColumnSpec> columns;  ///< by quantity; NAME_sd too
  std::map<std::string, double> constants;    ///< by quantity, SI
  std::map<std::string, SdSpec> sd;           ///< by quantity
  std::map<std::string, std::string> where;   ///< only rows with this text in that column
  LineChoice held_out;
  std::optional<LineChoice> fitted;  ///< the rest is held out
  std::optional<double> counts_as;
  bool by_name = false;  ///< columns that say what they are ("load_n", "f_x_sd") are taken, too
};

/// Throws std::invalid_argument "PLACE: unknown quantity ..., the nearest is ..." for a name that
/// this kind does not have. `sd`: NAME_sd is one, too.
const QuantityField& FindQuantity(TestKind kind, const std::string& name, const std::string& place);
/// The quantity that a column's name says, with its unit unless it has none: "load_n", "slip",
/// "f_x_sd", "sinkage [mm]". Empty: none.
std::string QuantityOfColumn(TestKind kind, const std::string& column);
TestKind ParseKind(const std::string& word, const std::string& place);

/// Reads the rows of a test into `soil`. Throws std::invalid_argument "FILE:LINE: what, expected
/// ..." for a column that is not there (with the nearest one), a unit that is not stated or that
/// the column's name contradicts, a cell that is no finite number, a negative pressure, a
/// sinkage far beyond the plate (another unit?), and a test without any row that tells something.
void ReadTest(const TestSpec& spec, MeasuredSoil* soil);

}  // namespace grouser::surrogate
