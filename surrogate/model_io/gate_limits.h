#pragma once

namespace grouser::surrogate {

/// What GateChecks judges by; an operator sets them by the names in kGateLimits.
struct GateLimits {
  double rmse_factor = 1.1, patch_share = 0.25, coverage_short = 0, dissipation_slack = 0.01,
         change_intervals = 1, change_share = 0.99, flag_share = 0.01, width_factor = 0;
};

struct GateLimitField {
  const char* option;  ///< of grouser-fit gate; of grouser-jobs with "gate-" before it
  const char* text;
  double GateLimits::*value;
  double most;  ///< the least is 0
};
inline constexpr GateLimitField kGateLimits[] = {
    {"rmse-factor", "held_out: rmse of every output on the runs held out, of the base's",
     &GateLimits::rmse_factor, 100},
    {"patch-share",
     "held_out: added to that, of sd_patch (what another placement of grains may do)",
     &GateLimits::patch_share, 100},
    {"coverage-short",
     "coverage: runs held out that intervals may cover fewer than chance leaves of 90 %",
     &GateLimits::coverage_short, 1e6},
    {"width-factor",
     "interval_width: mean half width of every output over the base's; 0: what chance leaves of "
     "the base's training runs",
     &GateLimits::width_factor, 100},
    {"dissipation-slack", "dissipation: power that may come from nowhere, of load times speed",
     &GateLimits::dissipation_slack, 1},
    {"change-intervals",
     "change, domain_change: how far an answer may move, in half-widths of the base's interval",
     &GateLimits::change_intervals, 1e6},
    {"change-share", "domain_change: of the domain's states where that must hold",
     &GateLimits::change_share, 1},
    {"flag-share", "new_flags: of the domain's states that may get a flag which the base lacks",
     &GateLimits::flag_share, 1},
};

}  // namespace grouser::surrogate
