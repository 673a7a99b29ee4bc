#pragma once

#include <string>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"

namespace grouser::surrogate {

struct GateResult {
  std::string name;
  bool passed;
  std::string detail;
};

/// What a candidate must show before it may replace its base:
/// - self_test: loads, golden vectors reproduced, finite over a scan;
/// - held_out: rmse on the runs held out at most 1.1 of the base's plus a
///   quarter of the base's sd_patch at them (rms), for every output;
/// - coverage: covers at most one held-out mean fewer than the base, per output;
/// - symmetry: both mirrors exact over a scan;
/// - dissipation: torque x spin covers pull x speed: T r w/r - F_x v_x - F_y v_y
///   >= -0.01 load M over the domain;
/// - change: inside the base's interval at its training states, those nearer to
///   a new run than 0.3 on the unit sphere and a factor 1.5 in load excepted.
/// Throws std::runtime_error when one of the two is no model at all.
std::vector<GateResult> GateChecks(const v1alpha1::Model& base, const v1alpha1::Model& candidate);

}  // namespace grouser::surrogate
