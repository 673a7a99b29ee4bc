#pragma once

#include <string>

namespace CLI {
class App;
}

namespace grouser::records {

/// A command line as JSON, of which man pages and completions are made (packaging/command_lines):
/// program, path (names of the subcommands that lead to it), text, footer, falls_through (options
/// of what is above are taken after it too; of the one described these are in above), and
/// - options: names ("--json", "-h"; of a positional its one name), positional, required, text,
///   default, type (CLI11's, with its checks), values: most values it takes (0: a flag);
/// - subcommands: the same of each, with its name, but for program, path and above.
/// Hidden options and subcommands (of group "") are left out.
std::string DescribedCommandLine(const CLI::App& app);

/// Adds the hidden --describe-command-line to `app` and all its subcommands: prints the above and
/// ends with exit code 0, whatever else is required. To be called once all options are there; `app`
/// must be there while it parses.
void DescribeOnDemand(CLI::App& app);

/// Options of `app` and its subcommands that take a number (FLOAT) refuse "nan" as bad usage:
/// "--load: got nan, expected a number". CLI11's own checks (Range, PositiveNumber) let it through.
/// To be called once all options are there.
void RefuseNaN(CLI::App& app);

}  // namespace grouser::records
