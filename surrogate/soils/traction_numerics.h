#pragma once

#include <array>

namespace grouser::surrogate {

/// A wheel and its load as the numeric laws of traction know them.
struct NumericWheel {
  double diameter_m = 0;        ///< d
  double width_m = 0;           ///< b
  double load_n = 0;            ///< W
  double deflection = 0;        ///< delta/h of the tyre on hard ground [-]; 0: a rigid wheel
  double section_height_m = 0;  ///< h of the tyre
};

/// What these laws know of a soil.
struct ConeStrength {
  double index_pa = 0;           ///< CI
  double gradient_pa_per_m = 0;  ///< G
};

/// Cn = CI b d/W.
double WheelNumeric(const NumericWheel& wheel, const ConeStrength& cone);
/// Bn = Cn (1 + 5 delta/h)/(1 + 3 b/d).
double BrixiusNumeric(const NumericWheel& wheel, const ConeStrength& cone);
/// Ns = G (b d)^1.5/W delta/h (Turnage, WES): 0 for a rigid wheel.
double SandNumeric(const NumericWheel& wheel, const ConeStrength& cone);
/// CP/CI, CP = W/(2 b sqrt(d a - a^2) (b/h)^0.52), a = delta + 0.026 d.
double PressureOverCone(const NumericWheel& wheel, const ConeStrength& cone);

/// Over the load. NaN: the law does not say.
struct TractionRatios {
  double gross;                                      ///< torque over radius
  double resistance;                                 ///< against motion
  double net() const { return gross - resistance; }  ///< drawbar pull
};

/// Published laws of a straight wheel at a slip s (of driving 1 - v/(r w)). All but the last are of
/// driving alone, s from 0 to 1; the last says of s from -1 to 1.
///
/// Wismer & Luth 1973, J. Terramechanics 10(2), 49-61: gross 0.75 (1 - exp(-0.3 Cn s)), resistance
/// 1.2/Cn + 0.04. Cohesive-frictional soils that do not compact much; tyres of b/d near 0.3 and
/// delta/h near 0.2.
TractionRatios WismerLuth(const NumericWheel& wheel, const ConeStrength& cone, double slip);
/// Brixius 1987, ASAE paper 87-1622: gross 0.88 (1 - exp(-0.1 Bn)) (1 - exp(-7.5 s)) + 0.04,
/// resistance 1/Bn + 0.04 + 0.5 s/sqrt(Bn). Cohesive-frictional soils; bias-ply tyres. The gross
/// of MAVS lacks the 0.04 (docs/references.md), so that its net would be smaller by as much.
TractionRatios Brixius(const NumericWheel& wheel, const ConeStrength& cone, double slip);
/// The law of sand that Mason et al. 2018 (below) compare theirs with: gross X - X Y/(Ns + 10 + Y),
/// X = 0.66, Y = 4.71 + 1.72/s; of a rigid wheel, Ns = 0, it does not say.
TractionRatios SandByNumeric(const NumericWheel& wheel, const ConeStrength& cone, double slip);
/// Mason, Williams, Vahedifard & Priddy 2018, J. Terramechanics 79, 33-40: gross
///   -0.5 + (T + 0.5)/(1 + A exp(-7 s))^(1/C), T = 0.42 + 0.009/q, A = 0.76 + 0.014/q,
///   C = 1.56 - 0.022/q, q = CP/CI,
/// braked, towed and driven wheels on dry sand. It does not say where it gives a wheel of slip
/// 0 a brake torque (q below 0.0333): there traction falls as the soil gets stronger. Beyond, at
/// slips from 0 to 0.3, gross still has a flat peak over q. Resistance of driven wheels: 0.4 q +
/// 0.6 s - 0.03, not said where that is negative, of braked ones 0.21 q - 0.75 s + 0.04 (Williams,
/// Vahedifard, Mason & Priddy 2017, J. Defense Modeling and Simulation).
TractionRatios MasonSand(const NumericWheel& wheel, const ConeStrength& cone, double slip);

struct NumericLaw {
  const char* key;  ///< in JSON
  const char* name;
  TractionRatios (*ratios)(const NumericWheel&, const ConeStrength&, double slip);
  const char* about;  ///< soils, tyres, and what of it was confirmed
};
inline constexpr std::array<NumericLaw, 4> kNumericLaws = {{
    {"wismer_luth", "Wismer-Luth", WismerLuth,
     "Wismer & Luth 1973: cohesive-frictional soils, not this sand; tyres of b/d 0.3, delta/h 0.2"},
    {"brixius", "Brixius", Brixius,
     "Brixius 1987: cohesive-frictional soils, not this sand; bias-ply tyres"},
    {"sand_numeric", "N_s", SandByNumeric,
     "N_s: dry sand, pneumatic tyres (Turnage's numeric; as Mason et al. 2018 have it); gross "
     "alone"},
    {"mason", "Mason", MasonSand,
     "Mason et al. 2018: dry sand, tyres; resistance of Williams et al. 2017"},
}};

}  // namespace grouser::surrogate
