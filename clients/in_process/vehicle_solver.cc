#include <algorithm>
#include <array>
#include <utility>

#include "clients/in_process/grouser/vehicle.h"
#include "clients/in_process/vehicle_parts.h"
#include "surrogate/vehicle/fields.h"

namespace grouser {
namespace {

constexpr std::size_t kChunk = 64;  // motions that are solved together

// Spans in the order of the tables of surrogate/vehicle/fields.h, which have their names.
constexpr std::array<std::span<const double> Motions::*, vehicle::kMotionFields.size()>
    kMotionSpans = {&Motions::acceleration, &Motions::yaw_acceleration, &Motions::grade,
                    &Motions::bank, &Motions::worse_by_sd};
constexpr std::array<std::span<double> Solutions::*, vehicle::kSolutionFields.size()>
    kSolutionSpans = {&Solutions::residual,
                      &Solutions::v_x,
                      &Solutions::v_y,
                      &Solutions::yaw_rate,
                      &Solutions::side_slip,
                      &Solutions::steering,
                      &Solutions::pitching_moment,
                      &Solutions::f_x,
                      &Solutions::f_y,
                      &Solutions::m_z,
                      &Solutions::shaft_power,
                      &Solutions::electric_power,
                      &Solutions::tip_margin,
                      &Solutions::torque_margin,
                      &Solutions::sinkage_margin};
constexpr std::array<std::span<double> WheelSpans::*, vehicle::kWheelFields.size()> kWheelSpans = {
    &WheelSpans::load,       &WheelSpans::rim_speed,  &WheelSpans::v_x,   &WheelSpans::v_y,
    &WheelSpans::slip,       &WheelSpans::slip_angle, &WheelSpans::steer, &WheelSpans::f_x,
    &WheelSpans::f_y,        &WheelSpans::torque,     &WheelSpans::m_z,   &WheelSpans::sinkage,
    &WheelSpans::shaft_power};
constexpr std::array<std::span<double> Powers::*, vehicle::kPowerFields.size()> kPowerSpans = {
    &Powers::electric, &Powers::shaft, &Powers::drive,        &Powers::rolling,  &Powers::slip,
    &Powers::scrub,    &Powers::grade, &Powers::acceleration, &Powers::imbalance};
constexpr std::array<std::span<double> Powers::*, vehicle::kIntervalFields.size()> kIntervalSpans =
    {&Powers::electric_low, &Powers::electric_high, &Powers::joules_per_metre,
     &Powers::joules_per_metre_low, &Powers::joules_per_metre_high};

struct Sizes {
  std::size_t wheels, drives, soils;
  bool steered;
};

std::size_t CountOf(const Motions& in, const Sizes& sizes) noexcept {
  return in.rim_speed.empty() ? in.v_x.size() : in.rim_speed.size() / sizes.drives;
}

void CheckMotions(const Motions& in, const Sizes& sizes, FaultFinder* finder) noexcept {
  const std::size_t n = CountOf(in, sizes);
  if (in.rim_speed.empty()) {
    finder->Size("yaw_rate", in.yaw_rate, n);
    finder->Size("steering", in.steering, 0, true);
  } else {
    finder->Size("rim_speed", in.rim_speed, n * sizes.drives, true);
    finder->Size("v_x", in.v_x, 0, true);
    finder->Size("yaw_rate", in.yaw_rate, 0, true);
    finder->Size("steering", in.steering, n);
  }
  for (std::size_t k = 0; k < kMotionSpans.size(); ++k) {
    finder->Size(vehicle::kMotionFields[k].name, in.*kMotionSpans[k], n);
  }
  finder->Size("draw", in.draw, n);
  if (in.soil.size() != n * sizes.wheels) finder->Size("soil", in.soil, n);
}

void CheckSolutions(const Solutions& out, std::size_t n, const Sizes& sizes,
                    FaultFinder* finder) noexcept {
  constexpr std::array<const char*, kWheelSpans.size()> kNames = {
      "wheel.load",       "wheel.rim_speed", "wheel.v_x",        "wheel.v_y", "wheel.slip",
      "wheel.slip_angle", "wheel.steer",     "wheel.f_x",        "wheel.f_y", "wheel.torque",
      "wheel.m_z",        "wheel.sinkage",   "wheel.shaft_power"};
  finder->Size("reasons", out.reasons, n, true);
  for (std::size_t k = 0; k < kSolutionSpans.size(); ++k) {
    finder->Size(vehicle::kSolutionFields[k].name, out.*kSolutionSpans[k], n);
  }
  finder->Size("rim_speed", out.rim_speed, n * sizes.drives);
  for (std::size_t k = 0; k < kWheelSpans.size(); ++k) {
    finder->Size(kNames[k], out.wheel.*kWheelSpans[k], n * sizes.wheels);
  }
  finder->Size("wheel.flags", out.wheel.flags, n * sizes.wheels);
}

void CheckPowers(const Powers& out, std::size_t n, const Sizes& sizes, double sds,
                 FaultFinder* finder) noexcept {
  finder->Size("reasons", out.reasons, n, true);
  finder->Size("residual", out.residual, n);
  for (std::size_t k = 0; k < kPowerSpans.size(); ++k) {
    finder->Size(vehicle::kPowerFields[k].name, out.*kPowerSpans[k], n);
  }
  for (std::size_t k = 0; k < kIntervalSpans.size(); ++k) {
    finder->Size(vehicle::kIntervalFields[k].name, out.*kIntervalSpans[k], n);
  }
  finder->Size("wheel_shaft", out.wheel_shaft, n * sizes.wheels);
  finder->Number(std::isfinite(sds) && sds >= 0, "sds", sds, "a finite number from 0 on");
}

vehicle::Motion MotionOf(const Motions& in, const Sizes& sizes, std::size_t i) noexcept {
  vehicle::Motion m;
  if (in.rim_speed.empty()) {
    m.v_x_m_per_s = in.v_x[i];
    m.yaw_rate_rad_per_s = EntryOf(in.yaw_rate, i);
  } else {
    m.given = vehicle::Motion::Given::kControls;
    std::copy_n(in.rim_speed.begin() + static_cast<std::ptrdiff_t>(i * sizes.drives), sizes.drives,
                m.rim_speed_m_per_s.begin());
    m.steering_rad = EntryOf(in.steering, i);
  }
  for (std::size_t k = 0; k < kMotionSpans.size(); ++k) {
    m.*vehicle::kMotionFields[k].member = EntryOf(in.*kMotionSpans[k], i);
  }
  if (!in.draw.empty()) m.draw = in.draw[i];
  if (in.soil.empty()) return m;
  const bool by_wheel = in.soil.size() != CountOf(in, sizes);
  for (std::size_t w = 0; w < sizes.wheels; ++w) {
    m.soil[w] = by_wheel ? in.soil[i * sizes.wheels + w] : in.soil[i];
  }
  return m;
}

void Write(const vehicle::Solution& s, const Sizes& sizes, std::size_t i,
           const Solutions& out) noexcept {
  out.reasons[i] = s.reasons;
  for (std::size_t k = 0; k < kSolutionSpans.size(); ++k) {
    const std::span<double> to = out.*kSolutionSpans[k];
    if (!to.empty()) to[i] = s.*vehicle::kSolutionFields[k].member;
  }
  for (std::size_t d = 0; d < sizes.drives && !out.rim_speed.empty(); ++d) {
    out.rim_speed[i * sizes.drives + d] = s.rim_speed_m_per_s[d];
  }
  for (std::size_t w = 0; w < sizes.wheels; ++w) {
    const std::size_t at = i * sizes.wheels + w;
    for (std::size_t k = 0; k < kWheelSpans.size(); ++k) {
      const std::span<double> to = out.wheel.*kWheelSpans[k];
      if (!to.empty()) to[at] = s.wheel[w].*vehicle::kWheelFields[k].member;
    }
    if (!out.wheel.flags.empty()) out.wheel.flags[at] = s.wheel[w].flags;
  }
}

void Write(const vehicle::PowerInterval& p, const Sizes& sizes, std::size_t i,
           const Powers& out) noexcept {
  out.reasons[i] = p.solution.reasons;
  if (!out.residual.empty()) out.residual[i] = p.solution.residual;
  for (std::size_t k = 0; k < kPowerSpans.size(); ++k) {
    const std::span<double> to = out.*kPowerSpans[k];
    if (!to.empty()) to[i] = p.mean.*vehicle::kPowerFields[k].member;
  }
  for (std::size_t k = 0; k < kIntervalSpans.size(); ++k) {
    const std::span<double> to = out.*kIntervalSpans[k];
    if (!to.empty()) to[i] = p.*vehicle::kIntervalFields[k].member;
  }
  for (std::size_t w = 0; w < sizes.wheels && !out.wheel_shaft.empty(); ++w) {
    out.wheel_shaft[i * sizes.wheels + w] = p.mean.wheel[w];
  }
}

}  // namespace

struct VehicleSolver::Parts {
  explicit Parts(const Vehicle& v)
      : vehicle(v),
        sizes{v.wheels(), v.drives(), v.soils().size(), v.steered()},
        solver(v.parts_->file.vehicle, v.parts_->file.grounds),
        planner(v.parts_->file.vehicle, v.parts_->file.grounds, 1),
        powers(&solver),
        motions(kChunk),
        solutions(kChunk) {}

  Vehicle vehicle;  // keeps the models
  Sizes sizes;
  vehicle::Solver solver;
  vehicle::SpeedPlanner planner;  // of probabilities
  vehicle::PowerBatch powers;
  std::vector<vehicle::Motion> motions;
  std::vector<vehicle::Solution> solutions;
  std::size_t draws = 0;

  Fault FaultOf(const Motions& in, const Solutions& out) const noexcept {
    FaultFinder finder;
    CheckMotions(in, sizes, &finder);
    CheckSolutions(out, CountOf(in, sizes), sizes, &finder);
    return finder.fault();
  }
  Fault FaultOf(const Motions& in, const Powers& out, double sds) const noexcept {
    FaultFinder finder;
    CheckMotions(in, sizes, &finder);
    CheckPowers(out, CountOf(in, sizes), sizes, sds, &finder);
    return finder.fault();
  }
  Fault FaultOf(const Motions& in, const Margins& margins, std::span<const double> least,
                std::span<const double> most) const noexcept {
    FaultFinder finder;
    CheckMotions(in, sizes, &finder);
    finder.Check(margins);
    finder.Size("least", least, CountOf(in, sizes), true);
    finder.Size("most", most, CountOf(in, sizes), true);
    return finder.fault();
  }
};

VehicleSolver::VehicleSolver(const Vehicle& vehicle) : parts_(std::make_unique<Parts>(vehicle)) {}
VehicleSolver::VehicleSolver(VehicleSolver&& other) noexcept = default;
VehicleSolver& VehicleSolver::operator=(VehicleSolver&& other) noexcept = default;
VehicleSolver::~VehicleSolver() = default;

bool VehicleSolver::Solve(const Motions& in, const Solutions& out) noexcept {
  if (parts_ == nullptr || parts_->FaultOf(in, out)) return false;
  Parts& p = *parts_;
  const std::size_t n = CountOf(in, p.sizes);
  for (std::size_t first = 0; first < n; first += kChunk) {
    const std::size_t count = std::min(kChunk, n - first);
    for (std::size_t k = 0; k < count; ++k) p.motions[k] = MotionOf(in, p.sizes, first + k);
    p.solver.Solve(std::span(p.motions).first(count), std::span(p.solutions).first(count));
    for (std::size_t k = 0; k < count; ++k) Write(p.solutions[k], p.sizes, first + k, out);
  }
  return true;
}

bool VehicleSolver::Energy(const Motions& in, const Powers& out, double sds) noexcept {
  if (parts_ == nullptr || parts_->FaultOf(in, out, sds)) return false;
  Parts& p = *parts_;
  std::size_t asked = 0, told = 0;
  p.powers.ForEach(
      CountOf(in, p.sizes), sds, {}, [&] { return MotionOf(in, p.sizes, asked++); },
      [&](const vehicle::PowerInterval& power) { Write(power, p.sizes, told++, out); });
  return true;
}

void VehicleSolver::UseDraws(std::size_t count) {
  if (parts_ == nullptr) return;
  const auto draws = DrawsOf(parts_->vehicle.parts_->file.grounds, count);
  parts_->solver.UseDraws(draws);
  parts_->planner.UseDraws(draws);
  parts_->draws = count;
}

bool VehicleSolver::ProbabilityByDraws(const Motions& in, const Margins& margins,
                                       std::span<double> least, std::span<double> most) noexcept {
  if (parts_ == nullptr || parts_->draws == 0 || parts_->FaultOf(in, margins, least, most)) {
    return false;
  }
  const vehicle::SpeedOptions options = ToOurs(margins);
  for (std::size_t i = 0; i < CountOf(in, parts_->sizes); ++i) {
    const vehicle::GoProbability go =
        parts_->planner.ProbabilityByDraws(MotionOf(in, parts_->sizes, i), options);
    least[i] = go.least;
    most[i] = go.most;
  }
  return true;
}

bool VehicleSolver::ProbabilityToGo(const Motions& in, const Margins& margins,
                                    std::span<double> least, std::span<double> most) noexcept {
  if (parts_ == nullptr || parts_->FaultOf(in, margins, least, most)) return false;
  const vehicle::SpeedOptions options = ToOurs(margins);
  for (std::size_t i = 0; i < CountOf(in, parts_->sizes); ++i) {
    const vehicle::GoProbability go =
        parts_->planner.ProbabilityToGo(MotionOf(in, parts_->sizes, i), options);
    least[i] = go.least;
    most[i] = go.most;
  }
  return true;
}

std::string VehicleSolver::Problem(const Motions& in, const Solutions& out) const {
  return parts_ ? parts_->FaultOf(in, out).Text() : "the solver was moved from";
}
std::string VehicleSolver::Problem(const Motions& in, const Powers& out, double sds) const {
  return parts_ ? parts_->FaultOf(in, out, sds).Text() : "the solver was moved from";
}
std::string VehicleSolver::Problem(const Motions& in, const Margins& margins,
                                   std::span<const double> least,
                                   std::span<const double> most) const {
  return parts_ ? parts_->FaultOf(in, margins, least, most).Text() : "the solver was moved from";
}

}  // namespace grouser
