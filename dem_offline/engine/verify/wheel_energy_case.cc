// Energy of a driven wheel, every channel integrated on its own.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

/// A wheel with grousers is pressed into a bed and driven at slip 0.3.
struct DrivenWheel {
  EnergyBalance before, after;
  double Work() const { return after.body_work - before.body_work; }
  double Residual() const { return after.Total() - before.Total(); }
};

DrivenWheel Drive(const BedSpec& spec, const std::vector<GrainState>& grains,
                  double rayleigh_fraction) {
  double top = 0;
  for (const GrainState& g : grains) top = std::max(top, g.z_m + g.radius_m);
  BedSpec fine = spec;
  fine.rayleigh_fraction = rayleigh_fraction;
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
  const DrivenWheel d = Drive(spec, grains, 0.1), half = Drive(spec, grains, 0.05);
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

}  // namespace

Cases WheelEnergyCases() { return {{"wheel_energy", Level::kQuick, EnergyOfADrivenWheel}}; }

}  // namespace grouser::dem::verify
