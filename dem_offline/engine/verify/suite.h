#pragma once

#include <string>
#include <vector>

#include "dem_offline/engine/verify/rows.h"

namespace grouser::dem::verify {

/// How far a run goes: quick cases alone (a minute of one core), the default
/// (minutes), or everything (hours).
enum class Level { kQuick, kDefault, kFull };

/// One case: appends rows, may throw (a failed row with the message).
struct Case {
  const char* name;
  Level level;  ///< the least level that runs it
  void (*run)(Rows&);
};
using Cases = std::vector<Case>;

struct Suite {
  std::string name;   ///< "verify" or "torture"
  std::string about;  ///< one sentence
  Cases cases;
};
Suite VerifySuite();
Suite TortureSuite();

struct SuiteOptions {
  Level level = Level::kDefault;
  std::string only;  ///< this case alone, whatever its level
  int threads = 2;
  bool progress = true;  ///< on stderr
  /// Where the worlds of the cases are stepped: "cpu", or a device of gpu/device.h,
  /// which takes one case at a time. What it refuses by name makes no row but a note.
  std::string device = "cpu";
};

struct SuiteResult {
  std::vector<Row> rows;  ///< in the order of the suite
  std::vector<std::string> notes;
  double seconds = 0;
  int Failed() const;
};

/// Runs the cases of a suite, each on one of the threads. Throws
/// std::invalid_argument for a name that no case has.
SuiteResult RunSuite(const Suite& suite, const SuiteOptions& options);

/// For people: aligned columns. For programs: an array of objects. For docs/.
std::string Table(const Suite& suite, const SuiteResult& result);
std::string Json(const Suite& suite, const SuiteResult& result);
std::string Markdown(const Suite& suite, const SuiteResult& result, const std::string& command);

/// What a command line asks of a suite.
struct SuiteCommand {
  bool quick = false, full = false, json = false, markdown = false, quiet = false;
  std::string only, device = "cpu";
  int threads = 2;
};
/// What the programs do: run, print on stdout, and return the exit status (1
/// when a row failed). program: how it was called, for the Markdown.
int RunAndPrint(const Suite& suite, const SuiteCommand& command, const std::string& program);

}  // namespace grouser::dem::verify
