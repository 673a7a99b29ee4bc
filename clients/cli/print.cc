#include "clients/cli/print.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "proto/records/message_json.h"

namespace grouser::cli {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

double At(const google::protobuf::RepeatedField<double>& values, int i) {
  return i < values.size() ? values[i] : std::numeric_limits<double>::quiet_NaN();
}

/// "-": unknown.
std::string MeasuredInterval(const v1alpha1::OutputArray& a, int i) {
  const double low = At(a.measured_low(), i), high = At(a.measured_high(), i);
  return std::isnan(low) ? "-" : fmt::format("[{:>11.5g},{:>11.5g}]", low, high);
}

void PrintGradients(const v1alpha1::WheelResponses& r, int i) {
  fmt::print("  {:8} {:>11} {:>11} {:>11} {:>11}\n", "d/d", "v_x [s/m]", "v_y", "rim", "load [/N]");
  const auto outputs = OutputsOf(r);
  for (int o = 0; o < surrogate::kOutputs; ++o) {
    const v1alpha1::OutputArray& a = *outputs[o];
    fmt::print("  {:8} {:>11.5g} {:>11.5g} {:>11.5g} {:>11.5g}  {}\n",
               surrogate::kOutputFields[o].name, At(a.d_v_x(), i), At(a.d_v_y(), i),
               At(a.d_rim_speed(), i), At(a.d_load(), i), surrogate::kOutputFields[o].unit);
  }
}

void PrintState(const v1alpha1::WheelResponses& r, int i, double load) {
  fmt::print("state {}: ", i);
  if (r.slip().slip_size() > 0) {
    fmt::print("slip {:.4g}, attack angle {:.4g} deg, ", At(r.slip().slip(), i),
               At(r.slip().attack_angle_rad(), i) * kDegPerRad);
  }
  if (r.velocity().v_x_m_per_s_size() > 0) {
    fmt::print("v_x {:.4g}, v_y {:.4g}, rim {:.4g} m/s, ", At(r.velocity().v_x_m_per_s(), i),
               At(r.velocity().v_y_m_per_s(), i), At(r.velocity().rim_speed_m_per_s(), i));
  }
  fmt::print("load {:.4g} N\n", load);
  fmt::print("  flags: {}\n", FlagNames(r.flags(i)));
  const auto outputs = OutputsOf(r);
  const auto any_has = [&outputs](int (v1alpha1::OutputArray::*size)() const) {
    return std::ranges::any_of(outputs, [size](const auto* a) { return (a->*size)() > 0; });
  };
  const bool with_parts =
      any_has(&v1alpha1::OutputArray::low_size) || any_has(&v1alpha1::OutputArray::high_size) ||
      any_has(&v1alpha1::OutputArray::sd_fit_size) || any_has(&v1alpha1::OutputArray::sd_form_size);
  if (with_parts) {
    fmt::print("  {:8} {:>11}  {:>25}  {:>25}  {:>9} {:>9} {:>9}\n", "output", "value",
               fmt::format("{:.0f} % interval ({})", 100 * r.interval_level(),
                           records::ShortName(r.interval_target())),
               fmt::format("{:.0f} % ({})", 100 * r.interval_level(),
                           records::ShortName(v1alpha1::INTERVAL_TARGET_MEASURED)),
               "sd_fit", "sd_patch", "sd_form");
  }
  for (int o = 0; o < surrogate::kOutputs; ++o) {
    const v1alpha1::OutputArray& a = *outputs[o];
    if (a.ByteSizeLong() == 0) continue;  // was not asked for
    fmt::print("  {:8} {:>11.5g}", surrogate::kOutputFields[o].name, At(a.value(), i));
    if (with_parts) {
      fmt::print("  [{:>11.5g},{:>11.5g}]  {:>25}  {:>9.3g} {:>9.3g} {:>9.3g}", At(a.low(), i),
                 At(a.high(), i), MeasuredInterval(a, i), At(a.sd_fit(), i), At(a.sd_patch(), i),
                 At(a.sd_form(), i));
    }
    fmt::print("  {}\n", surrogate::kOutputFields[o].unit);
  }
  if (any_has(&v1alpha1::OutputArray::d_load_size)) PrintGradients(r, i);
}

}  // namespace

std::array<const v1alpha1::OutputArray*, surrogate::kOutputs> OutputsOf(
    const v1alpha1::WheelResponses& r) {
  return {&r.f_x(), &r.f_y(), &r.f_z(), &r.torque(), &r.m_z(), &r.sinkage()};
}

void PrintJson(const google::protobuf::Message& message) {
  fmt::print("{}", records::ToJson(message, /*indented=*/true));
}

std::string FlagNames(std::uint32_t flags) {
  if (flags == 0) return "-";
  std::string text;
  for (std::uint32_t bit = 1; bit != 0; bit <<= 1) {
    if ((flags & bit) == 0) continue;
    if (!text.empty()) text += "|";
    text += v1alpha1::StateFlag_IsValid(static_cast<int>(bit))
                ? records::ShortName(static_cast<v1alpha1::StateFlag>(bit))
                : fmt::format("bit {}", bit);
  }
  return text;
}

void PrintResponses(const v1alpha1::EvaluateWheelsResponse& response,
                    const std::vector<double>& loads) {
  fmt::print(
      "model {} (generation {}), {:.1f} us in the server\n", response.model(),
      response.generation(),
      1e6 * static_cast<double>(response.latency().seconds()) + 1e-3 * response.latency().nanos());
  const auto& r = response.responses();
  for (int i = 0; i < r.flags_size(); ++i) {
    PrintState(r, i, loads[i]);
    const bool chosen = i < response.answered_by_size() && response.selectable_models_size() > 1;
    if (chosen)
      fmt::print("  answered by {}\n", response.selectable_models(response.answered_by(i)));
  }
  if (r.averaging_length_m() > 0) {
    fmt::print("sd_patch: one random placement, averaged over {:.3g} m; NaN: unknown\n",
               r.averaging_length_m());
  }
}

namespace {

void PrintInfo(const v1alpha1::ModelInfo& model) {
  const std::string aliases = fmt::format("{}", fmt::join(model.aliases(), ", "));
  const auto& domain = model.domain();
  fmt::print("{}@sha256:{}\n  aliases: {}{}\n", model.name(), model.digest(),
             aliases.empty() ? "-" : aliases, model.shipped() ? "; shipped" : "");
  fmt::print("  wheel {:.4g} x {:.4g} m on {}; {} runs\n", model.radius_m(), model.width_m(),
             model.soil(), model.runs());
  fmt::print(
      "  domain: slip {:.3g} to {:.3g}, |attack angle| to {:.3g} deg, load {:.3g} to {:.3g} N\n",
      domain.slip_min(), domain.slip_max(), domain.attack_angle_max_rad() * kDegPerRad,
      domain.load_min_n(), domain.load_max_n());
}

}  // namespace

void PrintModels(const v1alpha1::ListModelsResponse& response) {
  fmt::print("generation {}\n", response.generation());
  for (const auto& model : response.models()) PrintInfo(model);
}

void PrintModel(const v1alpha1::GetModelResponse& response) {
  PrintInfo(response.model());
  const auto& made = response.provenance();
  fmt::print("  made by: {} (grouser {}; {})\n", made.command(), made.grouser_version(),
             made.reason());
  if (!made.base_digest().empty()) fmt::print("  refitted from {}\n", made.base_digest());
  fmt::print("  {:9} {:8} {:16} {:>5} {:>10} {:>10} {:>10}\n", "region", "output", "set", "n",
             "rmse", "max", "covered90");
  for (const auto& row : response.errors()) {
    fmt::print("  {:9} {:8} {:16} {:>5} {:>10.3g} {:>10.3g} {:>10.3g}\n",
               records::ShortName(row.region()), row.output(), row.set(), row.n(), row.rmse(),
               row.max_abs(), row.covered90());
  }
}

void PrintJob(const v1alpha1::Job& job) {
  fmt::print("job {}: {}{}\n", job.job_id(), records::ShortName(job.job_state()),
             job.message().empty() ? "" : ", " + job.message());
  for (const auto& result : job.results()) {
    fmt::print("  result {} ({} bytes)\n", result.name(), result.bytes());
  }
  if (job.has_campaign()) {
    fmt::print("  campaign {}: {} runs\n", job.campaign().file(), job.campaign().runs());
    return;
  }
  if (job.has_calibration()) {
    fmt::print("  calibration of {} from {}\n", records::ShortName(job.calibration().kind()),
               job.calibration().data());
    return;
  }
  fmt::print("  refines {} at slip {:.4g}, attack angle {:.4g} deg, load {:.4g} N, seed {}\n",
             job.model(), job.state().slip(), job.state().attack_angle_rad() * kDegPerRad,
             job.state().load_n(), job.seed());
  if (!job.run_file().empty()) {
    fmt::print("  run {} sha256 {}\n", job.run_file(), job.run_sha256());
  }
  if (!job.candidate_digest().empty()) fmt::print("  candidate {}\n", job.candidate_digest());
  for (const auto& check : job.gate()) {
    fmt::print("  gate {}: {} {}\n", check.name(), check.passed() ? "passed" : "FAILED",
               check.detail());
  }
  if (job.job_state() == v1alpha1::JOB_STATE_AWAITING_PROMOTION) {
    const bool passed = std::ranges::all_of(job.gate(), &v1alpha1::GateCheck::passed);
    fmt::print(
        "  to promote it{}: ./grouser jobs promote {} --candidate {}{} --who WHO --why WHY\n",
        passed ? "" : " all the same", job.job_id(), job.candidate_digest().substr(0, kShownDigits),
        passed ? "" : " --override-gate");
  }
}

}  // namespace grouser::cli
