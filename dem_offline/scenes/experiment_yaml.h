#pragma once

#include <string>
#include <vector>

#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/scenes/yaml_section.h"

namespace grouser::campaign {

/// A file that an experiment names, as found.
struct NamedFile {
  std::string path;
  std::string note;  ///< of a mesh: what it is, and what was changed to make it one
};

/// Its name without the folder, and ": NOTE" where it has one.
std::string Described(const NamedFile& file);

/// An experiment file as read, with what belongs to its record.
struct ExperimentFile {
  dem::experiment::Experiment experiment;
  std::string text;               ///< of the file
  std::string resolved;           ///< the same as YAML, with all values in place
  std::vector<NamedFile> others;  ///< meshes, grains
  std::vector<std::string> sets;  ///< KEY=VALUE that stood over it
};

/// Reads an experiment file (docs/experiments.md); files that it names stand beside it, unless
/// their path is absolute. Throws InputError "FILE:LINE: key 'a.b': got X, expected Y"; what the
/// engine refuses (PlanOf) comes at the line of its key. sets: "a.b[1].c=VALUE", put in place
/// first.
ExperimentFile LoadExperiment(const std::string& file, const dem::WorkLimits& limits,
                              const std::vector<std::string>& sets = {});
/// The same of text; files are looked for in `folder`.
ExperimentFile ReadExperiment(const std::string& text, const std::string& file,
                              const std::string& folder, const dem::WorkLimits& limits,
                              const std::vector<std::string>& sets = {});
/// The same of a file that is read already; text and sets are the caller's.
ExperimentFile ReadExperiment(YamlSection root, const std::string& folder,
                              const dem::WorkLimits& limits);
/// Puts KEY=VALUE in place, one after another.
void PutSets(const std::vector<std::string>& sets, YamlSection* root);

}  // namespace grouser::campaign
