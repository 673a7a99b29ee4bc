#pragma once

#include <string>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/model_io/gate_limits.h"

namespace grouser::surrogate {

/// A check, its number and the limit that it has to keep. detail says both, then more.
struct GateResult {
  std::string name;
  bool passed;
  double value, limit;
  std::string detail;
};

/// What a candidate must show before it may replace its base; numbers in kGateLimits:
/// - self_test: loads, golden vectors reproduced, finite over a scan;
/// - held_out: for every output but f_z rmse on the runs held out at most rmse_factor of the base's
///   plus patch_share of the base's sd_patch at them (rms). Where no run is held out, on the base's
///   training runs;
/// - coverage: of every output but f_z the intervals cover at most coverage_short of those runs
///   fewer than the least count in the central 95 % of a binomial(n, 0.9), or than the base's where
///   those cover fewer. Covering more is no fault;
/// - interval_width: of every output but f_z the mean of half width over the base's, at those runs
///   and over states drawn evenly from the base's domain, at most width_factor; where that is 0 at
///   most what chance leaves of the base's training runs (WidthByChance). Not judged where the base
///   covers fewer of the runs than the band has: its intervals are to grow;
/// - symmetry: both mirrors exact over a scan;
/// - dissipation: torque x spin covers pull x speed: T r w/r - F_x v_x - F_y v_y
///   >= -dissipation_slack load M over the domain;
/// - change: at the base's training states |new - base| of every output at most change_intervals
///   half-widths of the base's interval;
/// - domain_change: the same on change_share of states drawn evenly from the base's domain;
/// - new_flags: of these states at most flag_share have a flag that the base does not give.
/// For both changes f_z is left out where the soil does not carry the load (MovedAt), and states
/// nearer to a new run than 0.3 on the unit sphere and a factor 1.5 in load are left out. Throws
/// std::runtime_error when one of the two is no model at all.
std::vector<GateResult> GateChecks(const v1alpha1::Model& base, const v1alpha1::Model& candidate,
                                   const GateLimits& limits = {});

}  // namespace grouser::surrogate
