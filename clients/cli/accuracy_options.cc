#include "clients/cli/accuracy_options.h"

#include <fmt/format.h>

#include <numbers>
#include <stdexcept>

#include "surrogate/models/outputs.h"

namespace grouser::cli {
namespace {

using v1alpha1::AccuracyRequest;

/// In the order of surrogate::Output.
constexpr void (AccuracyRequest::*kSetTolerance[surrogate::kOutputs])(double) = {
    &AccuracyRequest::set_f_x_n,   &AccuracyRequest::set_f_y_n,
    &AccuracyRequest::set_f_z_n,   &AccuracyRequest::set_torque_n_m,
    &AccuracyRequest::set_m_z_n_m, &AccuracyRequest::set_sinkage_m};

void ApplyTolerance(const std::string& text, AccuracyRequest* accuracy) {
  const std::size_t at = text.find('=');
  for (int o = 0; o < surrogate::kOutputs; ++o) {
    if (at == std::string::npos || text.substr(0, at) != surrogate::kOutputFields[o].name) continue;
    try {
      std::size_t used = 0;
      const std::string number = text.substr(at + 1);
      const double value = std::stod(number, &used);
      if (used != number.size()) break;
      (accuracy->*kSetTolerance[o])(value);
      return;
    } catch (const std::logic_error&) {  // no number, or one that a double cannot hold
      break;
    }
  }
  throw CLI::ValidationError("--tolerance", "'" + text +
                                                "', expected OUTPUT=NUMBER with f_x, f_y, f_z [N], "
                                                "torque, m_z [N m] or sinkage [m]");
}

}  // namespace

void AccuracyOptions::AddTo(CLI::App& command) {
  command
      .add_option("--tolerance", tolerances_,
                  "Largest errors to accept, as f_x=0.5,sinkage=0.002 [N, N m, m]")
      ->delimiter(',')
      ->group("Accuracy");
  command
      .add_option("--share", share_,
                  "The same for forces over load and moments over load and radius [-]")
      ->group("Accuracy");
  command
      .add_option("--against", against_,
                  "What tolerances are about: a fresh DEM run (dem), or a measurement (measured)")
      ->check(CLI::IsMember({"dem", "measured"}))
      ->capture_default_str()
      ->group("Accuracy");
  command.add_option("--budget-us", budget_us_, "What the evaluation may cost [us]")
      ->group("Accuracy");
}

void AccuracyOptions::Apply(v1alpha1::EvaluateWheelsRequest* request) const {
  if (against_ == "measured" && tolerances_.empty() && share_ == 0) {
    throw CLI::ValidationError("--against", "measured, expected --tolerance or --share beside it");
  }
  if (tolerances_.empty() && share_ == 0 && budget_us_ == 0) return;
  AccuracyRequest* accuracy = request->mutable_accuracy();
  for (const std::string& text : tolerances_) ApplyTolerance(text, accuracy);
  accuracy->set_share_of_load(share_);
  accuracy->set_budget_us(budget_us_);
  if (against_ == "measured") accuracy->set_interval_target(v1alpha1::INTERVAL_TARGET_MEASURED);
}

void PrintAccuracyOutcome(const v1alpha1::EvaluateWheelsResponse& response,
                          const std::string& jobs) {
  std::vector<int> count(response.selectable_models_size());
  for (const std::uint32_t k : response.answered_by()) ++count.at(k);
  for (int k = 0; k < response.selectable_models_size(); ++k) {
    fmt::print("answered by {}: {} of {} states\n", response.selectable_models(k), count[k],
               response.answered_by_size());
  }
  int unmet = 0;
  for (const std::uint32_t flags : response.responses().flags()) {
    if ((flags & v1alpha1::STATE_FLAG_TOLERANCE_UNMET) != 0) ++unmet;
  }
  if (unmet == 0) return;
  if (!response.has_refinement()) {
    fmt::print("tolerance unmet: {} states; no DEM run would mend them\n", unmet);
    return;
  }
  const v1alpha1::RefinementHint& hint = response.refinement();
  constexpr double kDegrees = 180 / std::numbers::pi;
  fmt::print(
      "tolerance unmet: {} states, state {} most: its {} may err by {:.3g} times the tolerance.\n"
      "A DEM run there helps most:\n"
      "  grouser-client submit --model {} --slip {:.6g} --angle-deg {:.6g} --load {:.6g}{}{}\n",
      unmet, hint.index(), hint.output(), hint.excess(), hint.model(), hint.state().slip(),
      hint.state().attack_angle_rad() * kDegrees, hint.state().load_n(),
      hint.state().speed_m_per_s() > 0
          ? fmt::format(" --speed {:.6g}", hint.state().speed_m_per_s())
          : "",
      jobs.empty() ? "" : " --jobs " + jobs);
}

}  // namespace grouser::cli
