#include "surrogate/fit/gate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <sstream>
#include <stdexcept>

#include "surrogate/fit/error_table.h"
#include "surrogate/fit/residual_field.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/run_summary.h"
#include "surrogate/model_io/self_test.h"

namespace grouser::surrogate {
namespace {

constexpr double kRmseFactor = 1.1, kRmsePatch = 0.25;
constexpr double kDissipationSlack = 0.01;

struct ScanState {
  VelocityState v;
  double load;
};

std::vector<ScanState> Scan(const v1alpha1::Domain& d) {
  std::vector<ScanState> states;
  const double speed = d.speed_m_per_s() > 0 ? d.speed_m_per_s() : 0.1;
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j <= 6; ++j) {
      for (const double share : {0.0, 0.5, 1.0}) {
        const double slip = d.slip_min() + (d.slip_max() - d.slip_min()) * i / 20;
        const VelocityState v = FromSlip(slip, d.attack_angle_max_rad() * j / 6, speed);
        if (!std::isfinite(v.v_x)) continue;  // no motion has this pair
        states.push_back({v, d.load_min_n() + share * (d.load_max_n() - d.load_min_n())});
      }
    }
  }
  return states;
}

WheelAnswer At(const TabulatedModel& model, const VelocityState& v, double load) {
  return model.EvaluateOne(v.v_x, v.v_y, v.rim_speed, load);
}

GateResult SelfTest(const v1alpha1::Model& candidate, const TabulatedModel& model) {
  try {
    MakeTestedModel(candidate);
  } catch (const std::runtime_error& error) {
    return {"self_test", false, error.what()};
  }
  const std::vector<ScanState> states = Scan(candidate.domain());
  for (const ScanState& s : states) {
    const WheelAnswer a = At(model, s.v, s.load);
    for (int o = 0; o < kOutputs; ++o) {
      if (std::isfinite(a.value[o]) && std::isfinite(a.half_width[o])) continue;
      return {"self_test", false,
              std::string(kOutputFields[o].name) + " is not finite in the domain"};
    }
  }
  return {"self_test", true,
          std::to_string(candidate.golden_size()) + " golden vectors, " +
              std::to_string(states.size()) + " states finite"};
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

std::vector<GateResult> HeldOut(const v1alpha1::Model& candidate, const TabulatedModel& old_model,
                                const TabulatedModel& new_model) {
  const std::vector<Sample> rows = SamplesOf(candidate, v1alpha1::RUN_ROLE_TEST);
  if (rows.empty()) {
    const std::string none = "no held-out run in the provenance: nothing to judge by";
    return {{"held_out", false, none}, {"coverage", false, none}};
  }
  const auto before = ErrorTable(CompareRows(old_model, rows), "held_out");
  const auto after = ErrorTable(CompareRows(new_model, rows), "held_out");
  GateResult rmse{"held_out", true, ""}, coverage{"coverage", true, ""};
  std::ostringstream rmse_text, coverage_text;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].region() != v1alpha1::REGION_ALL) continue;
    const std::string& output = before[i].output();
    const auto* o = std::ranges::find(kOutputFields, output, &OutputField::name);
    const double patch = PatchAt(old_model, rows, static_cast<int>(o - kOutputFields));
    const double allowed = kRmseFactor * before[i].rmse() + kRmsePatch * patch;
    rmse.passed &= after[i].rmse() <= allowed;
    rmse_text << output << " " << before[i].rmse() << " -> " << after[i].rmse() << " (at most "
              << allowed << "); ";
    const double lost = (before[i].covered90() - after[i].covered90()) * before[i].n();
    coverage.passed &= lost < 1.5;
    coverage_text << output << " " << before[i].covered90() << " -> " << after[i].covered90()
                  << "; ";
  }
  rmse.detail = std::to_string(rows.size()) + " runs, rmse: " + rmse_text.str();
  coverage.detail = std::to_string(rows.size()) + " runs: " + coverage_text.str();
  return {rmse, coverage};
}

GateResult Symmetry(const v1alpha1::Model& candidate, const TabulatedModel& model) {
  int count = 0;
  for (const ScanState& s : Scan(candidate.domain())) {
    const auto a = At(model, s.v, s.load).value;
    const auto left = At(model, {s.v.v_x, -s.v.v_y, s.v.rim_speed}, s.load).value;
    const auto back = At(model, {-s.v.v_x, s.v.v_y, -s.v.rim_speed}, s.load).value;
    ++count;
    for (int o = 0; o < kOutputs; ++o) {
      const ResidualTable::Parity parity = ResidualTable::ParityOf(o);
      if (left[o] == parity.y * a[o] && back[o] == parity.x * a[o]) continue;
      return {"symmetry", false, std::string(kOutputFields[o].name) + " is not mirrored"};
    }
  }
  return {"symmetry", true, std::to_string(count) + " states, exact"};
}

GateResult Dissipation(const v1alpha1::Model& candidate, const TabulatedModel& model) {
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
  std::ostringstream text;
  text << "least dissipated power " << worst << " load M at slip " << where.slip
       << ", attack angle " << where.attack_angle_rad * 180 / std::numbers::pi << " deg";
  return {"dissipation", worst >= -kDissipationSlack, text.str()};
}

bool Near(const FieldPoint& a, const FieldPoint& b) {
  double d2 = 0;
  for (int i = 0; i < 3; ++i) d2 += std::pow(a.direction[i] - b.direction[i], 2);
  return d2 < kNearDirection * kNearDirection && std::fabs(a.log_load - b.log_load) < kNearLogLoad;
}

GateResult Change(const v1alpha1::Model& base, const v1alpha1::Model& candidate,
                  const TabulatedModel& old_model, const TabulatedModel& new_model) {
  std::set<std::string> known;
  for (const v1alpha1::RunSummary& run : base.provenance().runs()) known.insert(run.run_id());
  std::vector<FieldPoint> fresh;
  for (const Sample& row : SamplesOf(candidate, v1alpha1::RUN_ROLE_TRAIN)) {
    if (known.count(row.source->run_id()) == 0)
      fresh.push_back(MakeFieldPoint(row.state(), row.load_n));
  }
  int checked = 0, outside = 0;
  std::string first;
  for (const Sample& row : SamplesOf(base, v1alpha1::RUN_ROLE_TRAIN)) {
    const FieldPoint point = MakeFieldPoint(row.state(), row.load_n);
    if (std::any_of(fresh.begin(), fresh.end(), [&](const auto& f) { return Near(point, f); })) {
      continue;
    }
    ++checked;
    const auto before = At(old_model, row.motion, row.load_n);
    const auto after = At(new_model, row.motion, row.load_n);
    for (int o = 0; o < kOutputs; ++o) {
      if (Covered(after.value[o], before.value[o], before.half_width[o])) continue;
      ++outside;
      if (first.empty()) {
        first = ", first " + std::string(kOutputFields[o].name) + " at run " + row.source->run_id();
      }
    }
  }
  return {"change", outside == 0,
          std::to_string(checked) + " training states, " + std::to_string(fresh.size()) +
              " new runs, " + std::to_string(outside) + " answers outside the old interval" +
              first};
}

}  // namespace

std::vector<GateResult> GateChecks(const v1alpha1::Model& base, const v1alpha1::Model& candidate) {
  const auto made_old = MakeScalar(base), made_new = MakeScalar(candidate);
  const TabulatedModel &old_model = *made_old, &new_model = *made_new;
  const std::vector<GateResult> held_out = HeldOut(candidate, old_model, new_model);
  return {SelfTest(candidate, new_model),
          held_out[0],
          held_out[1],
          Symmetry(candidate, new_model),
          Dissipation(candidate, new_model),
          Change(base, candidate, old_model, new_model)};
}

}  // namespace grouser::surrogate
