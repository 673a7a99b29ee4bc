#pragma once

#include <optional>
#include <string>
#include <vector>

#include "surrogate/soils/bevameter_table.h"
#include "surrogate/soils/cone_table.h"
#include "surrogate/soils/soil_table.h"

namespace grouser::surrogate {

/// Soils by name: the published ones and files that `grouser calibrate` wrote.
struct SoilLibrary {
  struct Entry {
    Soil soil;
    std::string file;
    std::string unusual;  ///< what of it no published soil has; empty: nothing
  };
  std::vector<Entry> entries;

  /// Adds a table's soils. A soil outside of what published ones have is taken and marked: it is
  /// measured. Throws as ReadSoils, and for a name that is known already.
  void Add(const std::string& file);

  /// By name (letters of either case), or the one soil of a file: `what` ends with .csv. Throws
  /// std::invalid_argument that lists the nearest names, or the names in the file.
  Entry Find(const std::string& what) const;
  /// Whether a soil has that name (letters of either case).
  bool Has(const std::string& name) const;
};

/// A soil that may be like the one that is wanted.
struct Suggestion {
  const SoilLibrary::Entry* entry;
  double likeness;                         ///< 0 to 1: words of the description in name and kind
  std::optional<double> moisture_percent;  ///< that the name states
};
/// The likest first; among equals those that state a moisture near `moisture_percent`. A word
/// counts as found at one wrong letter in four. Soils with half as many of the words
/// as the best, or fewer, are left out.
std::vector<Suggestion> SuggestSoils(const SoilLibrary& library, const std::string& like,
                                     std::optional<double> moisture_percent);

/// Tables for people and JSON for programs.
using SoilEntries = std::vector<const SoilLibrary::Entry*>;
std::string SoilListText(const SoilEntries& entries);
std::string SoilText(const SoilLibrary::Entry& entry);

/// Tables of soils of DEM grains.
struct SoilsOfGrains {
  std::vector<BevameterSoil> bevameters;
  std::vector<ConeIndex> cones;
  /// Whether one of them has a line of that name.
  bool Has(const std::string& name) const;
};
/// What they have of a soil's name; empty: nothing.
std::string GrainsText(const std::string& name, const SoilsOfGrains& grains);
/// The same for programs, as {"soil", "bevameter", "cone_index"} in an array; null: no line.
std::string GrainsJson(const std::string& name, const SoilsOfGrains& grains);
/// All values of soils, each with its `bevameter` and `cone_index`.
std::string SoilListJson(const SoilEntries& entries, const SoilsOfGrains& grains = {});

}  // namespace grouser::surrogate
