#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "dem_offline/campaign/estimate.h"

namespace grouser::campaign {

/// A campaign that is asked for by what it is about.
struct ProposalRequest {
  std::string wheel_file;  ///< radius_m, width_m, treads; contact where it is known
  std::string soil_file;   ///< of DEM grains (*.soil.yaml)
  std::string name;        ///< empty: of wheel and soil
  std::array<double, 2> load_n = {0, 0}, slip = {-1, 0.95}, angle_deg = {0, 90};
  double budget_s = 7200;
  int cores = 1;
};

/// As the request has it, or of wheel and soil.
std::string NameOf(const ProposalRequest& request);

/// Files of a campaign folder, and what is to be known of them.
struct Proposal {
  std::string name, soil, scene, campaign;  ///< texts of NAME.soil.yaml, ...
  double diameter_m = 0;                    ///< mean, of the grains
  int runs = 0;
  std::vector<std::string> notes;
};

/// By the size rules (docs/engine.md), with R the wheel's radius to its tips, b its width, d the
/// mean diameter of grains and z = 0.35 R the sinkage that is made room for: d as the soil has it,
/// but at most b/6 and the lowest tread; depth max(1.8 R, 12 d); width
/// max(b, 1.52 R) + 5 z + 10 d; tile of max(4.8 R, 30 d); hub travel 4.8 R; speed
/// 0.1 m/s sqrt(R/62.5 mm) (equal Froude number). As many runs as the budget pays at most: a
/// quarter of them held out, four of one state on as many beds; coarser grains, where so few fit
/// that a model would not learn, and the rules allow it. measure: the pace of a run. Throws
/// InputError.
Proposal Propose(const ProposalRequest& request,
                 const std::function<Pace(const v1alpha1::WheelTestSpec&)>& measure);

}  // namespace grouser::campaign
