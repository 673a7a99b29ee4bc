#include "surrogate/fit/plausible.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grouser::surrogate {
namespace {

std::string Within(int output, double value, double low, double high, const std::string& why) {
  if (value >= low && value <= high) return "";
  const char* unit = kOutputFields[output].unit;
  return fmt::format("{:.4g} {}, expected {:.4g} to {:.4g} {}: {}", value, unit, low, high, unit,
                     why);
}

/// Largest of the forces that a wheel meets along the ground, over the load.
double ForceOverLoad(const Sample& row, double radius_m) {
  const double arm = std::abs(row.mean[kTorque]) / radius_m;
  return std::max({std::abs(row.mean[kFx]), std::abs(row.mean[kFy]), arm}) / row.load_n;
}

std::string NameOf(const v1alpha1::RunSummary& run) {
  return run.file().empty() ? "run " + run.run_id()
                            : "run " + run.run_id() + " (" + run.file() + ")";
}

[[noreturn]] void Refuse(const v1alpha1::RunSummary& run, const std::string& what) {
  throw std::invalid_argument(NameOf(run) + ": " + what);
}

WheelLimits LimitsOf(const v1alpha1::Wheel& wheel, const v1alpha1::Soil& soil) {
  WheelLimits limits{wheel.radius_m()};
  limits.friction =
      std::max({plausible::kLeastFriction, wheel.friction(), soil.grains().friction()});
  for (const v1alpha1::Tread& tread : wheel.treads()) {
    limits.tread_height_m = std::max(limits.tread_height_m, tread.height_m());
  }
  return limits;
}

}  // namespace

WheelLimits LimitsOf(const v1alpha1::Scene& scene) { return LimitsOf(scene.wheel(), scene.soil()); }
WheelLimits LimitsOf(const v1alpha1::Model& model) { return LimitsOf(model.wheel(), model.soil()); }

std::string ImpossibleOutput(int output, double value, double load, const WheelLimits& limits) {
  const double r = limits.radius_m, outer = r + limits.tread_height_m;
  switch (output) {
    case kFz:
      return Within(output, value, (1 - plausible::kLoadShare) * load,
                    (1 + plausible::kLoadShare) * load, "the soil carries the load");
    case kTorque: {
      const double most = plausible::kMostFriction * limits.friction * load * outer;
      return Within(output, value, -most, most,
                    fmt::format("{:g} friction x load x radius", plausible::kMostFriction));
    }
    case kSinkage:
      return Within(output, value, -plausible::kLeastSinkage * r - limits.tread_height_m,
                    plausible::kMostSinkage * r, "the wheel's own size");
    default: {
      const double most = plausible::kMostForce * OutputScale(output, load, outer);
      return Within(output, value, -most, most,
                    fmt::format("{:g} times the load{}", plausible::kMostForce,
                                IsMoment(output) ? " x radius" : ""));
    }
  }
}

void CheckRuns(const TrainingSet& set) {
  const WheelLimits limits = LimitsOf(set.scene);
  std::vector<std::pair<double, const v1alpha1::RunSummary*>> forces;
  for (const auto role :
       {v1alpha1::RUN_ROLE_TRAIN, v1alpha1::RUN_ROLE_TEST, v1alpha1::RUN_ROLE_PATCH}) {
    for (const Sample& row : SamplesOf(set.runs, role)) {
      for (int o = 0; o < kOutputs; ++o) {
        const std::string why = ImpossibleOutput(o, row.mean[o], row.load_n, limits);
        if (!why.empty()) Refuse(*row.source, std::string(kOutputFields[o].name) + ": " + why);
      }
      forces.emplace_back(ForceOverLoad(row, limits.radius_m), row.source);
      if (forces.back().first >= plausible::kLeastForce) continue;
      Refuse(*row.source,
             fmt::format("f_x, f_y and torque/radius are at most {:.2g} of the load of "
                         "{:g} N, expected {:g} or more",
                         forces.back().first, row.load_n, plausible::kLeastForce));
    }
  }
  if (forces.empty()) return;
  const auto middle = forces.begin() + static_cast<std::ptrdiff_t>(forces.size() / 2);
  std::nth_element(forces.begin(), middle, forces.end());
  if (middle->first >= plausible::kLeastMedianForce) return;
  Refuse(*middle->second, fmt::format("f_x, f_y and torque/radius are at most {:.2g} of the load, "
                                      "and less in half of the {} runs, expected {:g} or more",
                                      middle->first, forces.size(), plausible::kLeastMedianForce));
}

}  // namespace grouser::surrogate
