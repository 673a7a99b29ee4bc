#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dem_offline/scenes/experiment_yaml.h"

namespace grouser::campaign {

/// One run of a sweep.
struct SweepMember {
  std::vector<std::string> sets;    ///< KEY=VALUE over the file: of the axes, and the seed
  std::vector<std::string> values;  ///< of Sweep::keys
  std::uint64_t seed = 1;
  bool held_out = false;
};

/// A number of a member: of one column of its series, over a window of time.
struct SweepResult {
  enum class Of { kMean, kLast, kLeast, kMost, kDeviation };
  std::string name, column;
  Of of = Of::kMean;
  double from_s = 0, to_s = std::numeric_limits<double>::infinity();  ///< < 0: from the end
};

/// Many runs of one experiment file.
struct Sweep {
  std::string name, text, file, folder;
  std::vector<std::string> user_sets;  ///< over the file, before those of members
  std::vector<std::string> keys;       ///< that vary
  std::vector<SweepMember> members;    ///< the first axis varies slowest, the seed fastest
  std::vector<SweepResult> results;
};

inline constexpr std::size_t kMostMembers = 10000;

/// The sweep of an experiment file; nothing: it has none. Throws InputError as ReadExperiment.
std::optional<Sweep> ReadSweep(const std::string& text, const std::string& file,
                               const std::string& folder,
                               const std::vector<std::string>& sets = {});
std::optional<Sweep> LoadSweep(const std::string& file, const std::vector<std::string>& sets = {});

/// A member as an experiment file by itself: its text is that of the file with all values in place
/// and without the sweep, so that it stays the same while others are added. Throws InputError as
/// ReadExperiment, with the member's values.
ExperimentFile ReadMember(const Sweep& sweep, const SweepMember& member,
                          const dem::WorkLimits& limits);

/// "key=value, key=value": what tells a member from the others.
std::string Describe(const Sweep& sweep, const SweepMember& member);

/// Throws InputError for a result whose column is not among those of a member's series.
void CheckResults(const Sweep& sweep, const std::vector<std::string>& columns);
/// NaN: the series has nothing in the window.
double ValueOf(const SweepResult& result, const std::map<std::string, std::vector<double>>& series);

}  // namespace grouser::campaign
