// Energy of a driven wheel, every channel integrated on its own.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

/// A wheel with grousers is pressed into a bed and driven at slip 0.3.
struct DrivenWheel {
  EnergyBalance before, after;
  double Work() const { return after.body_work - before.body_work; }
  /// Work and the grains' fall [J].
  double Given() const { return Work() + std::abs(after.potential - before.potential); }
  double Residual() const { return after.Total() - before.Total(); }
};

DrivenWheel Drive(const BedSpec& spec, const std::vector<GrainState>& grains, double step_share) {
  double top = 0;
  for (const GrainState& g : grains) top = std::max(top, g.z_m + g.radius_m);
  BedSpec fine = spec;
  fine.step_share = step_share;
  WorldConfig c = fine.Config();
  c.energy = true;
  const double radius = 0.04, speed = 0.1, slip = 0.3;
  Body wheel;
  wheel.shape =
      TreadedWheel(radius, 0.05, {Tread{.count = 9, .height_m = 0.006, .root_thickness_m = 0.004}});
  wheel.motion = BodyMotion::kPrescribed;
  wheel.position_m = {0.07, 0.5 * spec.width_m, top + radius + 0.007};
  World world(c, Scene(grains, {Floor(), wheel}));
  world.Start();
  DrivenWheel out;
  out.before = world.Balance();
  const auto steps = [&](double t) { return static_cast<std::int64_t>(std::llround(t / c.dt_s)); };
  world.body(1).velocity_m_per_s = {0, 0, -0.08};
  RunOrThrow(world, steps(0.25));
  world.body(1).velocity_m_per_s = {speed * (1 - slip), 0, 0};
  world.body(1).spin_rad_per_s = {0, speed / radius, 0};
  RunOrThrow(world, steps(0.6));
  out.after = world.Balance();
  return out;
}

void EnergyOfADrivenWheel(Rows& rows) {
  const BedSpec spec;
  const std::vector<GrainState> grains = Settle(spec);
  const DrivenWheel d = Drive(spec, grains, 0.5), half = Drive(spec, grains, 0.25);
  const EnergyBalance& e = d.after;
  rows.AtMost("driven grouser wheel: residual over the work done [-]", 1e-3,
              std::abs(d.Residual()) / d.Work(), "sum of channels = work");
  rows.AtMost("the same at half the step [-]", 1e-3, std::abs(half.Residual()) / half.Work(),
              "sum of channels = work");
  const double lost = e.Dissipated();
  rows.AtLeast(
      "least of normal damping, tangential damping, slip, rolling, over their sum [-]", 1e-3,
      std::min(std::min(e.normal_damping, e.tangent_damping), std::min(e.slip, e.rolling)) / lost,
      "each channel works");
  rows.Note(
      Format("work %.4g J = kinetic %.3g + potential %.3g + stored %.3g + normal damping "
             "%.3g + tangential damping %.3g + slip %.3g + rolling %.3g J; residual %.2g J, "
             "%.2g J at half the step",
             d.Work(), e.kinetic - d.before.kinetic, e.potential - d.before.potential,
             e.stored - d.before.stored, e.normal_damping, e.tangent_damping, e.slip, e.rolling,
             d.Residual(), half.Residual()));
}

/// What rolling takes is bounded by the work done, and half the step gives the same.
void RollingOfADrivenWheel(Rows& rows) {
  const std::vector<GrainState> grains = Settle(BedSpec{});
  for (const char* rolling : {"constant_torque", "own_spin", "epsd"}) {
    BedSpec spec;
    spec.laws = {.rolling = rolling};
    const DrivenWheel d = Drive(spec, grains, 1), half = Drive(spec, grains, 0.5);
    const double given = d.Given();
    rows.AtMost(Format("%s: residual at the default step over what is put in [-]", rolling), 0.02,
                std::abs(d.Residual()) / given, "sum of channels = work");
    rows.AtMost(Format("%s: rolling over the work and the grains' fall [-]", rolling), 1,
                d.after.rolling / given, "dissipation takes what is put in");
    rows.Relative(Format("%s: rolling at half the step over that at the step [-]", rolling), 1,
                  half.after.rolling / d.after.rolling, 0.1, "converged");
    rows.Note(
        Format("%s: work %.4g J, fall %.3g J, rolling %.4g J, residual %.2g J; at half the "
               "step %.4g, %.3g, %.4g, %.2g J",
               rolling, d.Work(), given - d.Work(), d.after.rolling, d.Residual(), half.Work(),
               half.Given() - half.Work(), half.after.rolling, half.Residual()));
  }
}

/// Laws whose springs and dashpots are stiffer than Young's modulus and the restitution say:
/// the step that they ask for keeps the energy.
void StepsThatLawsBear(Rows& rows) {
  const struct {
    const char* name;
    Laws laws;
    double restitution = 0.5, rolling_friction = 0.1, rolling_damping = 0.3;
  } hard[] = {
      {"linear_spring, 2e4 N/m",
       {"linear_spring",
        "linear_history",
        "epsd",
        "none",
        {{"linear_spring", "stiffness_n_per_m", 2e4}}}},
      {"hertz_restitution, e 0.05", {.rolling = "epsd"}, 0.05},
      {"hertz_dashpot, 2 N s/m",
       {"hertz_dashpot",
        "linear_history",
        "epsd",
        "none",
        {{"hertz_dashpot", "damping_n_s_per_m", 2}}}},
      {"hertz_oden_martins, 1e4 kg/(m s)",
       {"hertz_oden_martins",
        "linear_history",
        "epsd",
        "none",
        {{"hertz_oden_martins", "damping_kg_per_m_s", 1e4}}}},
      {"kelvin_regularised, k_t = 6 k_n",
       {"hertz_restitution",
        "kelvin_regularised",
        "epsd",
        "none",
        {{"kelvin_regularised", "stiffness_ratio", 6}}}},
      {"epsd, mu_r 1, eta 2", {.rolling = "epsd"}, 0.5, 1.0, 2.0},
  };
  for (const auto& h : hard) {
    BedSpec spec;
    spec.laws = h.laws;
    spec.surfaces.restitution = h.restitution;
    spec.surfaces.rolling_friction = h.rolling_friction;
    spec.surfaces.rolling_damping = h.rolling_damping;
    const DrivenWheel d = Drive(spec, Settle(spec), 1);
    rows.AtMost(Format("%s: residual at the default step over what is put in [-]", h.name), 0.02,
                std::abs(d.Residual()) / d.Given(), "sum of channels = work");
    rows.Note(Format("%s: step %.3g s, work %.4g J, residual %.2g J", h.name, spec.Config().dt_s,
                     d.Work(), d.Residual()));
  }
}

}  // namespace

Cases WheelEnergyCases() {
  return {{"wheel_energy", Level::kQuick, EnergyOfADrivenWheel},
          {"wheel_energy_rolling", Level::kDefault, RollingOfADrivenWheel},
          {"steps_that_laws_bear", Level::kDefault, StepsThatLawsBear}};
}

}  // namespace grouser::dem::verify
