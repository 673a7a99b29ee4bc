#include <utility>

#include "clients/in_process/grouser/vehicle.h"
#include "clients/in_process/vehicle_parts.h"

namespace grouser {
namespace {

constexpr bool Same(Binding ours, vehicle::Binding theirs) {
  return static_cast<std::uint8_t>(ours) == static_cast<std::uint8_t>(theirs);
}
static_assert(Same(Binding::kSpeedLimit, vehicle::Binding::kSpeedLimit) &&
              Same(Binding::kTraction, vehicle::Binding::kTraction) &&
              Same(Binding::kLateralGrip, vehicle::Binding::kLateralGrip) &&
              Same(Binding::kTorque, vehicle::Binding::kTorque) &&
              Same(Binding::kRollover, vehicle::Binding::kRollover) &&
              Same(Binding::kSinkage, vehicle::Binding::kSinkage) &&
              Same(Binding::kUntrainedSpeed, vehicle::Binding::kUntrainedSpeed) &&
              Same(Binding::kModelDomain, vehicle::Binding::kModelDomain) &&
              Same(Binding::kAcceleration, vehicle::Binding::kAcceleration) &&
              Same(Binding::kBraking, vehicle::Binding::kBraking) &&
              Same(Binding::kInput, vehicle::Binding::kInput));

Binding ToPublic(vehicle::Binding binding) noexcept {
  return static_cast<Binding>(static_cast<std::uint8_t>(binding));
}

vehicle::SpeedOptions ToOurs(const SpeedOptions& o) noexcept {
  vehicle::SpeedOptions ours = ToOurs(o.margins);
  ours.speed_limit_m_per_s = o.speed_limit;
  ours.worse_by_sd = o.worse_by_sd;
  ours.acceleration_m_per_s2 = o.acceleration;
  ours.braking_m_per_s2 = o.braking;
  ours.start_m_per_s = o.start;
  ours.end_m_per_s = o.end;
  return ours;
}

void Check(const SpeedOptions& o, FaultFinder* finder) noexcept {
  const auto positive = [&](const char* name, double x) {
    finder->Number(x > 0 && std::isfinite(x), name, x, "a finite number above 0");
  };
  const auto from_0 = [&](const char* name, double x) {
    finder->Number(x >= 0 && std::isfinite(x), name, x, "a finite number from 0 on");
  };
  positive("speed_limit", o.speed_limit);
  finder->Number(std::isfinite(o.worse_by_sd), "worse_by_sd", o.worse_by_sd, "a finite number");
  finder->Check(o.margins);
  positive("acceleration", o.acceleration);
  positive("braking", o.braking);
  from_0("start", o.start);
  from_0("end", o.end);
}

}  // namespace

const char* NameOfBinding(Binding binding) noexcept {
  return binding <= Binding::kInput
             ? vehicle::NameOf(static_cast<vehicle::Binding>(static_cast<std::uint8_t>(binding)))
             : "";
}

struct SpeedPlanner::Parts {
  Parts(const Vehicle& v, std::size_t most_points)
      : vehicle(v),
        soils(v.soils().size()),
        planner(v.parts_->file.vehicle, v.parts_->file.grounds, most_points),
        path(most_points),
        plan(most_points) {}

  Vehicle vehicle;  // keeps the models
  std::size_t soils;
  vehicle::SpeedPlanner planner;
  std::vector<vehicle::PathPoint> path;
  std::vector<vehicle::SpeedPoint> plan;
  std::size_t draws = 0;

  void SetPath(const Path& in) noexcept {
    for (std::size_t i = 0; i < in.s.size(); ++i) {
      path[i] = {in.s[i], EntryOf(in.curvature, i), EntryOf(in.grade, i), EntryOf(in.bank, i),
                 in.soil.empty() ? std::uint8_t{0} : in.soil[i]};
    }
  }
  Fault FaultOf(const Path& in, const SpeedOptions& options) const noexcept {
    FaultFinder finder;
    CheckPath(in, options, &finder);
    return finder.fault();
  }
  Fault FaultOf(const Path& in, const SpeedOptions& options, const SpeedPlan& out) const noexcept {
    FaultFinder finder;
    const std::size_t n = in.s.size();
    CheckPath(in, options, &finder);
    finder.Size("speed", out.speed, n, true);
    finder.Size("acceleration", out.acceleration, n);
    finder.Size("safe", out.safe, n);
    finder.Size("shortfall", out.shortfall, n);
    finder.Size("safe_binding", out.safe_binding, n);
    finder.Size("binding", out.binding, n);
    finder.Size("holds", out.holds, n);
    return finder.fault();
  }
  void CheckPath(const Path& in, const SpeedOptions& options, FaultFinder* finder) const noexcept {
    const std::size_t n = in.s.size();
    finder->Number(n >= 2 && n <= path.size(), "points", static_cast<double>(n),
                   "2 to what the planner has room for");
    finder->Size("curvature", in.curvature, n);
    finder->Size("grade", in.grade, n);
    finder->Size("bank", in.bank, n);
    finder->Size("soil", in.soil, n);
    Check(options, finder);
    finder->Finite("s", in.s);
    finder->Finite("curvature", in.curvature);
    finder->Finite("grade", in.grade);
    finder->Finite("bank", in.bank);
    for (std::size_t i = 1; i < n && !finder->fault(); ++i) {
      finder->Number(in.s[i] > in.s[i - 1], "s", in.s[i], "more than that before",
                     static_cast<std::ptrdiff_t>(i));
    }
    for (std::size_t i = 0; i < in.soil.size() && !finder->fault(); ++i) {
      finder->Number(in.soil[i] < soils, "soil", in.soil[i], "an index into soils()",
                     static_cast<std::ptrdiff_t>(i));
    }
  }
  Fault FaultOf(double speed, std::uint8_t soil, double worse_by_sd,
                const Margins& margins) const noexcept {
    FaultFinder finder;
    finder.Number(std::isfinite(speed), "speed", speed, "a finite number");
    finder.Number(soil < soils, "soil", soil, "an index into soils()");
    finder.Number(std::isfinite(worse_by_sd), "worse_by_sd", worse_by_sd, "a finite number");
    finder.Check(margins);
    return finder.fault();
  }
};

SpeedPlanner::SpeedPlanner(const Vehicle& vehicle, std::size_t most_points)
    : parts_(std::make_unique<Parts>(vehicle, most_points)) {}
SpeedPlanner::SpeedPlanner(SpeedPlanner&& other) noexcept = default;
SpeedPlanner& SpeedPlanner::operator=(SpeedPlanner&& other) noexcept = default;
SpeedPlanner::~SpeedPlanner() = default;

void SpeedPlanner::UseDraws(std::size_t count) {
  if (parts_ == nullptr) return;
  parts_->planner.UseDraws(DrawsOf(parts_->vehicle.parts_->file.grounds, count));
  parts_->draws = count;
}

bool SpeedPlanner::PlanByDraws(const Path& in, const SpeedOptions& options,
                               std::span<const double> speed, std::span<const double> acceleration,
                               double* holds, std::span<double> by_point,
                               std::span<const double> safe) noexcept {
  const std::size_t n = in.s.size();
  if (parts_ == nullptr || parts_->draws == 0 || speed.size() != n || acceleration.size() != n ||
      !(by_point.empty() || by_point.size() == n) || !(safe.empty() || safe.size() == n)) {
    return false;
  }
  if (parts_->FaultOf(in, options)) return false;
  for (std::size_t i = 0; i < n; ++i) {
    if (!(speed[i] >= 0) || !std::isfinite(speed[i]) || !std::isfinite(acceleration[i])) {
      return false;
    }
    if (!safe.empty() && (!(safe[i] >= 0) || !std::isfinite(safe[i]))) return false;
  }
  for (std::size_t i = 0; i < n; ++i) {
    parts_->plan[i].speed_m_per_s = speed[i];
    parts_->plan[i].acceleration_m_per_s2 = acceleration[i];
    parts_->plan[i].safe_m_per_s = safe.empty() ? 1 : safe[i];
  }
  parts_->SetPath(in);
  *holds = parts_->planner.PlanByDraws(std::span(parts_->path).first(n), ToOurs(options),
                                       std::span(parts_->plan).first(n), by_point);
  return true;
}

bool SpeedPlanner::Plan(const Path& in, const SpeedOptions& options, const SpeedPlan& out,
                        std::size_t* not_held) noexcept {
  if (parts_ == nullptr || parts_->FaultOf(in, options, out)) return false;
  const std::size_t n = in.s.size();
  parts_->SetPath(in);
  const std::size_t count = parts_->planner.Plan(std::span(parts_->path).first(n), ToOurs(options),
                                                 std::span(parts_->plan).first(n));
  if (not_held != nullptr) *not_held = count;
  const auto put = [](auto span, std::size_t i, auto value) {
    if (!span.empty()) span[i] = value;
  };
  for (std::size_t i = 0; i < n; ++i) {
    const vehicle::SpeedPoint& p = parts_->plan[i];
    out.speed[i] = p.speed_m_per_s;
    put(out.acceleration, i, p.acceleration_m_per_s2);
    put(out.safe, i, p.safe_m_per_s);
    put(out.shortfall, i, p.shortfall);
    put(out.safe_binding, i, ToPublic(p.safe_binding));
    put(out.binding, i, ToPublic(p.binding));
    put(out.holds, i, std::uint8_t{p.holds});
  }
  return true;
}

bool SpeedPlanner::Grades(double speed, std::uint8_t soil, double worse_by_sd,
                          const Margins& margins, GradeRange* out) noexcept {
  if (parts_ == nullptr || parts_->FaultOf(speed, soil, worse_by_sd, margins)) return false;
  vehicle::SpeedOptions options = ToOurs(margins);
  options.worse_by_sd = worse_by_sd;
  const vehicle::GradeRange g = parts_->planner.Grades(speed, soil, options);
  *out = {g.any, g.down_rad, g.up_rad, ToPublic(g.binding_down), ToPublic(g.binding_up)};
  return true;
}

std::string SpeedPlanner::Problem(const Path& in, const SpeedOptions& options,
                                  const SpeedPlan& out) const {
  return parts_ ? parts_->FaultOf(in, options, out).Text() : "the planner was moved from";
}
std::string SpeedPlanner::Problem(double speed, std::uint8_t soil, double worse_by_sd,
                                  const Margins& margins) const {
  return parts_ ? parts_->FaultOf(speed, soil, worse_by_sd, margins).Text()
                : "the planner was moved from";
}

}  // namespace grouser
