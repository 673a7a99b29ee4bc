#pragma once

#include <istream>
#include <optional>
#include <string>
#include <vector>

#include "surrogate/models/bekker_parameters.h"

namespace grouser::surrogate {

enum class SoilKind { kSand, kLoam, kClay, kSnow };  ///< simulants count as sand

const char* NameOf(SoilKind kind);
/// The kind of that name; none: there is no such one.
std::optional<SoilKind> FindSoilKind(const std::string& word);

/// A published soil, SI.
struct Soil {
  std::string name;
  double n = 0, k_c = 0, k_phi = 0;  ///< Bekker: [-], N/m^(n+1), N/m^(n+2)
  double cohesion_pa = 0, friction_angle_rad = 0;
  std::optional<double> density_kg_per_m3, shear_modulus_m;  ///< where published
  SoilKind kind = SoilKind::kSand;
  std::string source;
};

/// Reads a table such as surrogate/soils/bekker_soils.csv. Throws
/// std::invalid_argument "NAME:LINE: COLUMN: VALUE, expected ..."; `name` is for messages.
/// Refused: what no soil has or what shows another unit (N in a column of kN, radians,
/// m for mm, density 0), a name that stands there twice and, unless `accept_unusual`,
/// what no published soil has.
std::vector<Soil> ReadSoils(std::istream& table, const std::string& name,
                            bool accept_unusual = false);

/// surrogate/soils/bekker_soils.csv of $GROUSER_ROOT, else of the installation or checkout that
/// this program is in (os::RootOfProgram), else of the working folder.
std::string PublishedSoilsFile();
/// Another file of surrogate/ there.
std::string SurrogateFile(const std::string& path);

/// What of a soil no published one has, as "COLUMN: VALUE, expected ..."; empty: nothing.
std::string UnusualOf(const Soil& soil);

/// Such a table of these soils, which ReadSoils reads (to 6 digits).
std::string WriteSoils(const std::vector<Soil>& soils);

/// Parameters of the `bekker_untuned` kind: a wheel on a published soil with
/// nothing fitted. What the soil does not say is taken from the literature:
/// - density, if unpublished: 1600 (sand, loam), 1800 (clay), 300 (snow) kg/m^3;
/// - K, if unpublished: 10 mm (sand, loam), 6 mm (clay), 25 mm (snow) (Wong,
///   Theory of Ground Vehicles, ch. 2: firm sand 10, compact clay 6, fresh snow 25 to 50;
///   of these only the snow could be checked, in austinlines/PhD below);
/// - c1 = 0.18, c2 = 0.32: Wong & Reece (1967) for loose sand; compact sand has
///   0.43, 0.32. c3 = 0: they neglect the exit angle. Checked at second hand, the
///   paper itself was not at hand: public code quotes 0.18, 0.32 as "Wong and Reece
///   1967, loose sand" (austinlines/PhD, TerramechanicsDynamicsModel) and takes 0.43,
///   0.32 for their wheel (melanz/wheel-soil). Elsewhere 0.4, 0.15 stands for a lunar
///   simulant, 0.365, 0.503 and 0.33, 0.11 for Martian ones
///   (mmbaxter484/Mars-Terrain-Simulator; the first are Ishigami's of 2007). A DEM
///   campaign's own profiles say 0.35, 0.06 (docs/stress-profiles.md);
/// - sinkage_drive = 1.5: Lyasko's (2010) slip sinkage (1 + i)/(1 - i/2), which
///   the model's exp(1.5 D) follows within 5 % from slip 0.2 to 0.7;
/// - passive pressures: Rankine's tan^2(45 deg + phi/2); K_b = K.
/// c and phi are the soil's own: a smooth rim has less friction and pulls less.
BekkerParameters FromSoil(const Soil& soil, double gravity_m_per_s2 = 9.81);

}  // namespace grouser::surrogate
