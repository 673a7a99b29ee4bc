#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/wheel_model.h"
#include "surrogate/soils/cone_table.h"
#include "surrogate/soils/traction_numerics.h"

namespace grouser::surrogate {

struct NumericsRequest {
  std::optional<double> load_n;  ///< the middle of the training loads if not given
  std::vector<double> slips = {0.05, 0.1, 0.2, 0.3, 0.5, 0.7};
  double deflection = 0;                   ///< delta/h [-]; 0: a rigid wheel, as models are of
  std::optional<double> section_height_m;  ///< h; if not given the lesser of width and radius
  std::optional<ConeIndex> cone;           ///< of the model's soil
};

/// A model's straight wheel beside the numeric laws at its soil's cone index.
struct NumericsReport {
  struct OfLaw {
    TractionRatios at;  ///< at the cone index
    /// Of gross and of net: least and largest over the 90 % intervals of cone index and gradient,
    /// of 65 strengths, for a law need not be monotonic. NaN where it does not say at one of them.
    std::array<double, 2> low, high;
    /// Of gross and of net: all of low to high outside the model's interval. False where these are
    /// NaN.
    std::array<bool, 2> apart;
  };
  struct AtSlip {
    double slip;
    std::uint32_t flags;
    std::array<double, 2> value, low, high;  ///< gross, net: torque over load and radius, pull over
                                             ///< load, with the interval for a fresh DEM run
    std::array<OfLaw, kNumericLaws.size()> laws;
  };
  NumericWheel wheel;
  ConeIndex cone;
  double cone_share;  ///< half width of the cone index' interval over it; NaN: one bed
  std::vector<AtSlip> rows;
};

/// Throws std::invalid_argument "--OPTION: got X, expected Y", "NAME: training speed: ...".
NumericsReport CompareWithNumerics(const v1alpha1::Model& model, const NumericsRequest& request);
std::string NumericsText(const NumericsReport& report, const v1alpha1::Model& model,
                         const std::string& reference);
std::string NumericsJson(const NumericsReport& report, const std::string& reference);

}  // namespace grouser::surrogate
