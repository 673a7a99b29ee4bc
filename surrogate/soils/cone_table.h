#pragma once

#include <istream>
#include <optional>
#include <string>
#include <vector>

namespace grouser::surrogate {

/// What a cone penetrometer says of a soil: force over the area of the cone's base against the
/// depth of the base. The standard's (ASABE S313.3) has 30 degrees, 12.83 or 20.27 mm, 30 mm/s and
/// the mean over 0 to 150 mm; that of the virtual bevameter is as large as its grains need and says
/// so.
struct ConeIndex {
  std::string soil;  ///< its name
  std::string
      soil_sha256;      ///< of all values of its grains: SoilIdentity (surrogate/fit/soil_card.h)
  double index_pa = 0;  ///< mean from 0 to to_depth_m
  std::optional<double> index_se_pa;  ///< standard error over beds; none: one bed
  double gradient_pa_per_m = 0;       ///< slope of the line through it by least squares
  std::optional<double> gradient_se_pa_per_m;
  int beds = 0;  ///< 0: the index was given, and nothing below is known
  double to_depth_m = 0;
  double diameter_m = 0;  ///< of the base
  double angle_rad = 0;   ///< between opposite flanks
  double speed_m_per_s = 0;
  double grain_m = 0;            ///< mean diameter by mass
  std::string bevameter_sha256;  ///< of bevameter.json
  std::string source;
};

/// Reads a table such as surrogate/soils/cone_indices.csv (a bevameter's cone_index.csv). Throws
/// std::invalid_argument "NAME:LINE: COLUMN: VALUE, expected ..."; also where a soil stands twice,
/// for standard errors of one bed and for several beds without.
std::vector<ConeIndex> ReadConeIndices(std::istream& table, const std::string& name);

/// surrogate/soils/cone_indices.csv of the checkout or installation, where there is one, then those
/// of the files. Of a soil that comes again the last one holds. Throws as ReadConeIndices, or
/// "FILE: cause, expected ...".
std::vector<ConeIndex> ConeIndices(const std::vector<std::string>& more_files = {});

/// Two lines for people; a table of all.
std::string ConeText(const ConeIndex& cone);
std::string ConeListText(const std::vector<ConeIndex>& cones);
/// An array for programs, SI.
std::string ConeListJson(const std::vector<ConeIndex>& cones);

}  // namespace grouser::surrogate
