#pragma once

#include <string>
#include <vector>

#include "dem_offline/scenes/yaml_section.h"

namespace grouser::campaign {

/// What stands behind a key of an experiment file.
enum class KeyKind {
  kNumber,
  kDegrees,  ///< a number of degrees
  kCount,    ///< a whole number
  kText,
  kTexts,     ///< a list of two texts
  kChoice,    ///< one of `more`, separated by |
  kChoices,   ///< a list of some of `more`
  kSwitch,    ///< on or off
  kVector,    ///< a list of three numbers
  kAngles,    ///< a list of three angles in degrees
  kCounts,    ///< a list of three whole numbers
  kNumbers,   ///< a list of numbers
  kValues,    ///< a list of anything
  kSection,   ///< a mapping of the section `more`
  kSections,  ///< a list of such mappings, or one
  kLaws,      ///< names of laws, each a mapping of its settings (law registry)
};

/// One key of one section: the only place that names it. Reader, schema, documentation and the
/// search for the nearest key all read this table.
struct Key {
  const char* section;
  const char* name;
  KeyKind kind;
  const char* more;       ///< choices, or the name of a section
  const char* otherwise;  ///< what holds where it is left out, for people; "!": required
  const char* of;         ///< kinds of the section that know it, separated by |; empty: all
  const char* what;
};
const std::vector<Key>& ExperimentKeys();

/// The parts of "a|b|c".
std::vector<std::string> SplitChoices(const std::string& text);

/// The key of a section whose choice its `of` are values of ("do", "kind", "shape"); "": none.
std::string SelectorOf(const std::string& section);

/// JSON Schema (2020-12) of experiment files.
std::string ExperimentSchema();
/// The same as a Markdown table by section, for docs/experiments.md.
std::string ExperimentKeyTable();

/// A mapping of an experiment file: every key in it is in the table, in a section and under a
/// choice that know it, or the constructor throws InputError with the nearest key there is.
class KeyedSection {
 public:
  KeyedSection(YamlSection section, const std::string& name);

  bool Has(const char* key);
  double Number(const char* key);  ///< degrees come in radians
  double NumberOr(const char* key, double otherwise);
  std::uint64_t Count(const char* key, std::uint64_t most);
  std::uint64_t CountOr(const char* key, std::uint64_t otherwise, std::uint64_t most);
  std::string Text(const char* key);
  std::string TextOr(const char* key, const std::string& otherwise);
  /// Place of the text among the choices of the key; `otherwise` where it is left out.
  int Choice(const char* key);
  int ChoiceOr(const char* key, int otherwise);
  std::vector<int> Choices(const char* key);  ///< the places of a list of them
  bool Switch(const char* key, bool otherwise);
  std::vector<double> Vector(const char* key);  ///< three; angles in radians
  std::vector<std::uint64_t> Counts(const char* key, std::uint64_t most);
  std::vector<std::string> Texts(const char* key);
  std::vector<double> Numbers(const char* key);      ///< none twice
  std::vector<std::string> Values(const char* key);  ///< as YAML
  KeyedSection Section(const char* key);
  std::vector<KeyedSection> Sections(const char* key);
  /// As YamlSection; every key that stands there must have been read.
  void Finish() const { section_.Finish(); }
  YamlSection& yaml() { return section_; }

 private:
  const Key& Find(const std::string& key) const;
  void CheckKeys();

  YamlSection section_;
  std::string name_;
};

}  // namespace grouser::campaign
