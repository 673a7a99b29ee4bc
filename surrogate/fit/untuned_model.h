#pragma once

#include <optional>
#include <string>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/fit/pair_errors.h"
#include "surrogate/soils/soil_table.h"

namespace grouser::surrogate {

struct UntunedRequest {
  std::string name;  ///< of the model
  v1alpha1::Wheel wheel;
  Soil soil;
  double gravity_m_per_s2 = 9.81;
  std::optional<double> load_min_n, load_max_n;  ///< of the domain; none: see below
  std::string command;                           ///< for the provenance
};

/// A `bekker` model to which nothing was fitted: FromSoil and the wheel, treads by the height of
/// the tallest. Its intervals are SpreadOf(errors), what such models of other wheels were off by
/// against DEM, scaled to this wheel; `untuned` is set, and every answer has the flag UNTUNED.
/// Error rows: "untuned", those errors; "other_pairs", the share that intervals from the other
/// pairs alone hold. Domain: all slips from -1 to 1 and attack angles; loads, where not given,
/// from that at which a freely rolling wheel sinks by 0.02 r to that at 0.4 r; speeds to the
/// largest Froude number of the pairs' test runs.
/// Throws std::invalid_argument for parameters that the model does not take, and for loads that
/// are none.
v1alpha1::Model MakeUntuned(const UntunedRequest& request, const PairErrors& errors);

}  // namespace grouser::surrogate
