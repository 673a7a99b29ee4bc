#pragma once

#include <string>
#include <vector>

#include "surrogate/calibrate/test_spec.h"

namespace grouser::surrogate {

/// How CSVs that are named on the command line are to be read; columns that say what they are
/// ("load_n", "sinkage_mm", "f_x_sd") need no word.
struct CommandLineTest {
  std::string kind;                    ///< plate, shear, press or wheel
  std::vector<std::string> columns;    ///< "SOURCE=QUANTITY" or "SOURCE=QUANTITY:UNIT"
  std::vector<std::string> constants;  ///< "QUANTITY=60 mm"
};

/// Reads measurement files (.yaml, .yml: docs/calibration.md) and CSVs, all of one soil. `within`:
/// the folder that files which a measurement file names may not leave; empty: none. Throws
/// records::InputError or std::invalid_argument: what, where, expected.
MeasuredSoil ReadMeasuredSoil(const std::vector<std::string>& files, const CommandLineTest& csv,
                              const std::string& within = "");

}  // namespace grouser::surrogate
