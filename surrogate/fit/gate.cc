#include "surrogate/fit/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

#include "surrogate/fit/error_table.h"
#include "surrogate/fit/gate_parts.h"
#include "surrogate/fit/residual_field.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/run_summary.h"
#include "surrogate/model_io/self_test.h"

namespace grouser::surrogate {
namespace {

GateResult SelfTest(const v1alpha1::Model& candidate, const TabulatedModel& model) {
  const std::vector<ScanState> states = Scan(candidate.domain());
  int wrong = 0;
  std::string what = fmt::format("{} golden vectors reproduced, {} states finite",
                                 candidate.golden_size(), states.size());
  try {
    MakeTestedModel(candidate);
  } catch (const std::runtime_error& error) {
    wrong = 1;
    what = error.what();
  }
  for (const ScanState& s : states) {
    const WheelAnswer a = At(model, s.v, s.load);
    for (int o = 0; o < kOutputs; ++o) {
      if (std::isfinite(a.value[o]) && std::isfinite(a.half_width[o])) continue;
      if (++wrong == 1) what = std::string(kOutputFields[o].name) + " is not finite in the domain";
    }
  }
  return Judged("self_test", wrong, Side::kAtMost, 0, what);
}

// Of one output, root mean square over the runs.
double PatchAt(const TabulatedModel& model, const std::vector<Sample>& rows, int output) {
  double sum = 0;
  for (const Sample& row : rows) {
    const double sd = At(model, row.motion, row.load_n).sd_patch[output];
    sum += sd * sd / static_cast<double>(rows.size());
  }
  return std::sqrt(sum);
}

std::vector<GateResult> HeldOut(const Known& known, const TabulatedModel& old_model,
                                const TabulatedModel& new_model, const GateLimits& limits) {
  const std::vector<Sample>& rows = known.rows;
  if (rows.empty()) {
    const std::string none = "no run in the provenance: nothing to judge by";
    return {{"held_out", false, NAN, limits.rmse_factor, none},
            {"coverage", false, NAN, limits.coverage_short, none}};
  }
  const auto before = ErrorTable(CompareRows(old_model, rows), "held_out");
  const auto after = ErrorTable(CompareRows(new_model, rows), "held_out");
  double worst = 0, most_short = 0;
  std::string rmse, coverage;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].region() != v1alpha1::REGION_ALL) continue;
    const std::string& output = before[i].output();
    const auto* o = std::ranges::find(kOutputFields, output, &OutputField::name);
    const double patch =
        limits.patch_share * PatchAt(old_model, rows, static_cast<int>(o - kOutputFields));
    const double above = std::max(after[i].rmse() - patch, 0.0);
    const double factor = above == 0 ? 0 : above / before[i].rmse();
    worst = std::fmax(worst, std::isnan(factor) ? INFINITY : factor);
    rmse += fmt::format("; {} {:.4g} -> {:.4g}, at most {:.4g}", output, before[i].rmse(),
                        after[i].rmse(), limits.rmse_factor * before[i].rmse() + patch);
    // A base that covers fewer than is honest is not to be made worse.
    const int least = std::min(LeastHonest(before[i]), CoveredOf(before[i]));
    const int covered = CoveredOf(after[i]);
    most_short = std::fmax(most_short, least - covered);
    coverage +=
        fmt::format("; {} {} (base {}), at least {}", output, covered, CoveredOf(before[i]), least);
  }
  const std::string runs = fmt::format("{} {}", rows.size(), known.what);
  return {Judged("held_out", worst, Side::kAtMost, limits.rmse_factor,
                 fmt::format("times the base's rmse beyond {:.4g} sd_patch, {}{}",
                             limits.patch_share, runs, rmse)),
          Judged("coverage", most_short, Side::kAtMost, limits.coverage_short,
                 fmt::format("fewer in their intervals than chance leaves of 90 %, {}{}", runs,
                             coverage))};
}

GateResult Symmetry(const v1alpha1::Model& candidate, const TabulatedModel& model) {
  int count = 0, wrong = 0;
  std::string first = "all exact";
  for (const ScanState& s : Scan(candidate.domain())) {
    const auto a = At(model, s.v, s.load).value;
    const auto left = At(model, {s.v.v_x, -s.v.v_y, s.v.rim_speed}, s.load).value;
    const auto back = At(model, {-s.v.v_x, s.v.v_y, -s.v.rim_speed}, s.load).value;
    ++count;
    for (int o = 0; o < kOutputs; ++o) {
      const ResidualTable::Parity parity = ResidualTable::ParityOf(o);
      if (left[o] == parity.y * a[o] && back[o] == parity.x * a[o]) continue;
      if (++wrong == 1) first = std::string("first ") + kOutputFields[o].name;
    }
  }
  return Judged("symmetry", wrong, Side::kAtMost, 0,
                fmt::format("answers that are not mirrored, {} states, {}", count, first));
}

GateResult Dissipation(const v1alpha1::Model& candidate, const TabulatedModel& model,
                       double slack) {
  const double radius = candidate.wheel().radius_m();
  double worst = 1e300;
  ScanState at{};
  for (const ScanState& s : Scan(candidate.domain())) {
    const auto a = At(model, s.v, s.load).value;
    const double speed = std::fmax(std::fabs(s.v.rim_speed), std::hypot(s.v.v_x, s.v.v_y));
    const double power = a[kTorque] * s.v.rim_speed / radius - a[kFx] * s.v.v_x - a[kFy] * s.v.v_y;
    if (power / (s.load * speed) >= worst) continue;
    worst = power / (s.load * speed);
    at = s;
  }
  const SlipState where = ToSlip(at.v.v_x, at.v.v_y, at.v.rim_speed);
  return Judged("dissipation", worst, Side::kAtLeast, -slack,
                fmt::format("least dissipated power over load M, at slip {:.3g}, attack angle "
                            "{:.3g} deg",
                            where.slip, where.attack_angle_rad * 180 / std::numbers::pi));
}

bool Near(const FieldPoint& a, const FieldPoint& b) {
  double d2 = 0;
  for (int i = 0; i < 3; ++i) d2 += std::pow(a.direction[i] - b.direction[i], 2);
  return d2 < kNearDirection * kNearDirection && std::fabs(a.log_load - b.log_load) < kNearLogLoad;
}

bool NearAny(const FieldPoint& point, const std::vector<FieldPoint>& fresh) {
  return std::ranges::any_of(fresh, [&](const FieldPoint& f) { return Near(point, f); });
}

/// Runs that the candidate was fitted to and the base was not.
std::vector<FieldPoint> FreshRuns(const v1alpha1::Model& base, const v1alpha1::Model& candidate) {
  std::set<std::string> known;
  for (const v1alpha1::RunSummary& run : base.provenance().runs()) known.insert(run.run_id());
  std::vector<FieldPoint> fresh;
  for (const Sample& row : SamplesOf(candidate, v1alpha1::RUN_ROLE_TRAIN)) {
    if (!known.contains(row.source->run_id())) {
      fresh.push_back(MakeFieldPoint(row.state(), row.load_n));
    }
  }
  return fresh;
}

GateResult Change(const v1alpha1::Model& base, const std::vector<FieldPoint>& fresh,
                  const TabulatedModel& old_model, const TabulatedModel& new_model, double limit) {
  int checked = 0;
  Moved most;
  std::string at;
  for (const Sample& row : SamplesOf(base, v1alpha1::RUN_ROLE_TRAIN)) {
    if (NearAny(MakeFieldPoint(row.state(), row.load_n), fresh)) continue;
    ++checked;
    const Moved moved =
        MovedAt(At(old_model, row.motion, row.load_n), At(new_model, row.motion, row.load_n));
    if (moved.half_widths <= most.half_widths) continue;
    most = moved;
    at = fmt::format(", {} at run {}", kOutputFields[moved.output].name, row.source->run_id());
  }
  return Judged("change", most.half_widths, Side::kAtMost, limit,
                fmt::format("half-widths of the base's interval, {} training states away from {} "
                            "new runs{}",
                            checked, fresh.size(), at));
}

constexpr double kLeastAway = 0.1;  // of the domain's states, away from new runs

FieldPoint PointAt(const ScanState& s) {
  return MakeFieldPoint(ToCanonical(s.v.v_x, s.v.v_y, s.v.rim_speed), s.load);
}

std::vector<GateResult> OverDomain(const v1alpha1::Model& base,
                                   const std::vector<FieldPoint>& fresh,
                                   const TabulatedModel& old_model, const TabulatedModel& new_model,
                                   const GateLimits& limits) {
  std::vector<double> changes;
  std::uint32_t new_flags = 0;
  int flagged = 0;
  const std::vector<ScanState> states = Drawn(base.domain());
  for (const ScanState& s : states) {
    const WheelAnswer before = At(old_model, s.v, s.load), after = At(new_model, s.v, s.load);
    const std::uint32_t added = after.flags & ~before.flags;
    flagged += added != 0;
    new_flags |= added;
    if (NearAny(PointAt(s), fresh)) continue;
    changes.push_back(MovedAt(before, after).half_widths);
  }
  const auto inside = static_cast<double>(std::ranges::count_if(
      changes, [&](double change) { return change <= limits.change_intervals; }));
  // Where new runs are near almost everywhere, what is left says nothing of the domain.
  const bool enough =
      static_cast<double>(changes.size()) >= kLeastAway * static_cast<double>(states.size());
  const double share = enough ? inside / static_cast<double>(changes.size()) : NAN;
  std::string names;
  for (const FlagField& field : kFlagFields) {
    if ((new_flags & field.flag) != 0) names += std::string(" ") + field.name;
  }
  return {Judged("domain_change", share, Side::kAtLeast, limits.change_share,
                 fmt::format("of {} states of the domain away from {} new runs change by at most "
                             "{:.4g} half-widths of the base's interval, the most by {:.4g}{}",
                             changes.size(), fresh.size(), limits.change_intervals,
                             changes.empty() ? 0 : std::ranges::max(changes),
                             enough ? "" : "; too few of them to judge by")),
          Judged("new_flags", flagged / static_cast<double>(states.size()), Side::kAtMost,
                 limits.flag_share,
                 fmt::format("of {} states of the domain, {} in number{}", states.size(), flagged,
                             names.empty() ? "" : ":" + names))};
}

}  // namespace

std::vector<GateResult> GateChecks(const v1alpha1::Model& base, const v1alpha1::Model& candidate,
                                   const GateLimits& limits) {
  const auto made_old = MakeScalar(base), made_new = MakeScalar(candidate);
  const TabulatedModel &old_model = *made_old, &new_model = *made_new;
  const std::vector<FieldPoint> fresh = FreshRuns(base, candidate);
  const Known known = KnownRuns(base, candidate);
  const auto held_out = HeldOut(known, old_model, new_model, limits);
  const auto domain = OverDomain(base, fresh, old_model, new_model, limits);
  return {SelfTest(candidate, new_model),
          held_out[0],
          held_out[1],
          IntervalWidth(base, known, old_model, new_model, limits),
          Symmetry(candidate, new_model),
          Dissipation(candidate, new_model, limits.dissipation_slack),
          Change(base, fresh, old_model, new_model, limits.change_intervals),
          domain[0],
          domain[1]};
}

}  // namespace grouser::surrogate
