#pragma once

#include <array>
#include <istream>
#include <optional>
#include <string>
#include <vector>

namespace grouser::surrogate {

/// A parameter that a bevameter finds of a soil of grains, SI.
struct FoundParameter {
  double value = 0;
  std::optional<double> low, high;  ///< of 90 %, by profile likelihood; none: unbounded
  bool identified = true;           ///< false: rests on what is typical of published soils
};

/// Of the table's parameters: names, units and what is accepted.
struct FoundField {
  const char* name;    ///< in JSON and in the column not_identified
  const char* column;  ///< of the value; its interval's: COLUMN_low90, COLUMN_high90
  const char* symbol;
  const char* si_unit;
  const char* unit;  ///< of the column
  double si;         ///< SI units in one of the column's
  double low, high;  ///< accepted, in the column's unit
};
/// Bekker's p = (k_c/b + k_phi) z^n; tau = (c + p tan phi)(1 - exp(-j/K)), Mohr-Coulomb and
/// Janosi-Hanamoto; Reece's p = (c k_c' + gamma b k_phi')(z/b)^n with its own n and c, phi and K as
/// above (surrogate/calibrate/soil_law.h).
inline constexpr std::size_t kBekkerFound = 6, kFound = 10;
extern const std::array<FoundField, kFound> kFoundFields;

/// What `./grouser bevameter` finds of a soil of DEM grains. All of it belongs to the grain size.
struct BevameterSoil {
  std::string soil;  ///< its name
  std::string
      soil_sha256;  ///< of all values of its grains: SoilIdentity (surrogate/fit/soil_card.h)
  /// By kFoundFields. Reece's, those from kBekkerFound on: all, or none where the plates are of one
  /// width.
  std::array<std::optional<FoundParameter>, kFound> parameters;
  double density_kg_per_m3 = 0;  ///< of the bed
  std::string
      form;  ///< of pressure and sinkage that ./grouser calibrate soil took: "bekker", "reece"
  int beds = 0;
  double grain_m = 0;            ///< mean diameter by mass
  std::string bevameter_sha256;  ///< of bevameter.json
  std::string source;
};

/// Reads a table such as surrogate/soils/bevameter_soils.csv (a bevameter's bevameter_soil.csv).
/// Throws as ReadGrainLines; also where a value is outside of its interval.
std::vector<BevameterSoil> ReadBevameterSoils(std::istream& table, const std::string& name);

/// surrogate/soils/bevameter_soils.csv of the checkout or installation, where there is one, then
/// those of the files. Of a soil that comes again the last one holds. Throws as ReadBevameterSoils,
/// or "FILE: cause, expected ...".
std::vector<BevameterSoil> BevameterSoils(const std::vector<std::string>& more_files = {});

/// For people.
std::string BevameterText(const BevameterSoil& soil);
/// An array for programs, SI.
std::string BevameterListJson(const std::vector<BevameterSoil>& soils);

}  // namespace grouser::surrogate
