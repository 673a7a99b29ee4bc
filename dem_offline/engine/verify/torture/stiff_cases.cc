// Ratios, steps, speeds and overlaps that are too much.
#include <stdexcept>

#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

/// Large grains fall into a bed of grains a tenth as large.
void SizeRatio(Rows& rows) {
  BedSpec spec;
  spec.length_m = spec.width_m = 0.08;
  spec.smallest_d_m = spec.largest_d_m = 0.002;
  spec.grains = {5e7, 0.3};
  std::vector<GrainState> grains = Grid(spec, 0, 0.08, 0, 0.08, 0, 2000);
  const double above = 0.0046;
  for (int i = 0; i < 9; ++i) {
    GrainState g = {};
    g.x_m = 0.08 * (i % 3 + 0.5) / 3, g.y_m = 0.08 * (i / 3 + 0.5) / 3, g.z_m = above + 0.01;
    g.radius_m = 0.01, g.density_kg_per_m3 = spec.density;
    grains.push_back(g);
  }
  WorldConfig c = spec.Config();
  c.energy = true;
  World world(c, Scene(grains, {Floor()}));
  world.Start();
  const EnergyBalance before = world.Balance();
  RunOrThrow(world, std::llround(0.12 / c.dt_s));
  const EnergyBalance after = world.Balance();
  float deepest = 0;
  for (const float o : world.OverlapRatios()) deepest = std::max(deepest, o);
  double lowest = 1;
  for (int i = 0; i < world.count(); ++i) {
    const GrainState g = world.State(i);
    lowest = std::min(lowest, (g.z_m - g.radius_m) / g.radius_m);
  }
  rows.Holds("sizes 1:10 after 0.12 s: no fault, overlaps under 20 % of the smaller radius",
             deepest < 0.2, Format("deepest %.3f", deepest));
  rows.Holds("no grain is through the floor by more than 10 % of its radius", lowest > -0.1,
             Format("%.4f radii", lowest));
  rows.Below("the energy that is not booked stays under 1 % of what was dissipated", 0.01,
             std::abs(after.Total() - before.Total()) / after.Dissipated());
}

ContactModel SoftAndHard(double restitution) {
  ContactModel m;
  const Elastic soft = {1e6, 0.3}, hard = {1e9, 0.3};
  m.AddMaterial(soft);
  m.AddMaterial({kRigid, 0.3});
  m.AddMaterial(hard);
  const ContactProperties f = {
      .restitution = restitution, .friction = 0.5, .rolling_friction = 0.1};
  for (int a = 0; a < 3; ++a) {
    for (int b = a; b < 3; ++b) {
      if (a != 1 || b != 1) m.SetContactProperties(a, b, f);
    }
  }
  return m;
}

void StiffnessRatio(Rows& rows) {
  const double r = 0.005, v = 0.5;
  const Elastic soft = {1e6, 0.3}, hard = {1e9, 0.3};
  World pair(Cell(SoftAndHard(1), 0.1, 2e-6),
             {{0.05, 0.05, r, r, 2500, 0, 0, -v}, {0.05, 0.05, -r, r, 2500, 0, 0, v, 0, 0, 0, 2}});
  const HertzImpact exact =
      ExactHertz(SphereMass(r, 2500) / 2, r / 2, EffectiveModulus(soft, hard), 2 * v);
  const Impact hit = Follow(pair);
  const double off = hit.peak_overlap_m / exact.overlap_m - 1;
  rows.Holds("grains 1:1000 in stiffness collide as springs in series: peak overlap to 0.1 %",
             std::abs(off) < 1e-3, off);
  BedSpec spec;
  spec.length_m = spec.width_m = 0.06;
  spec.grains = hard;
  WorldConfig c = spec.Config();
  c.contacts = SoftAndHard(0.5);
  c.energy = true;
  std::vector<GrainState> grains = Grid(spec, 0, 0.06, 0, 0.06, 0, 125);
  for (std::size_t i = 0; i < grains.size(); i += 2) grains[i].material = 2;
  World bed(c, Scene(grains, {Floor()}));
  bed.Start();
  const EnergyBalance before = bed.Balance();
  RunOrThrow(bed, std::llround(0.15 / c.dt_s));
  rows.Below("a bed of both falls and settles: energy not booked under 1 % of what was dissipated",
             0.01, std::abs(bed.Balance().Total() - before.Total()) / bed.Balance().Dissipated());
}

/// A bed falls; how it came out at some multiple of the critical step.
struct Fall {
  std::string fault;
  double residual = 0;    ///< of the energy turned over
  double dissipated = 0;  ///< [J]
};
Fall FallAt(double times_critical) {
  BedSpec spec;
  spec.length_m = spec.width_m = 0.06;
  std::vector<GrainState> grains = Grid(spec, 0, 0.06, 0, 0.06, 0.05, 200);
  WorldConfig c = spec.Config();
  c.energy = true;
  World guess(c, Scene(grains, {Floor()}));
  c.dt_s = times_critical * guess.CriticalStep(0.1);  // they strike with that
  World world(c, Scene(grains, {Floor()}));
  world.Start();
  const EnergyBalance before = world.Balance();
  Fall out;
  const StepFault fault = world.Run(std::llround(0.3 / c.dt_s));
  out.fault = Explain(fault);
  const EnergyBalance after = world.Balance();
  out.dissipated = after.Dissipated();
  out.residual = (after.Total() - before.Total()) / (before.potential - after.potential);
  return out;
}

void Steps(Rows& rows) {
  BedSpec spec;
  WorldConfig c = spec.Config();
  c.guard_overlap = 0.01;
  const GrainState one = {0.1, 0.05, 0.02, 0.005, 2290};
  c.dt_s = 1e-9;
  const double critical = World(c, {one}).CriticalStep(c.guard_overlap);
  for (const double times : {0.5, 1.0, 2.0, 5.0}) {
    c.dt_s = times * critical;
    std::string said;
    try {
      World world(c, {one});
    } catch (const std::invalid_argument& error) {
      said = error.what();
    }
    const bool refused = said.find("dt_s") != std::string::npos;
    rows.Holds(Format("guard at %g times the critical step: %s", times,
                      times > 1 ? "refuses, naming dt_s" : "lets pass"),
               refused == (times > 1), said.empty() ? "accepted" : said);
  }
  const Fall fine = FallAt(0.125);
  for (const double times : {0.5, 1.0, 2.0, 5.0, 20.0}) {
    const Fall f = FallAt(times);
    const bool named = !f.fault.empty() || !(std::abs(f.residual) < 0.03);
    const double off = f.dissipated / fine.dissipated - 1;
    const bool sound = std::abs(off) < 0.04;
    rows.Holds(Format("guard overridden, %g times critical: an answer off by over 4 %% is named by "
                      "a fault or by an energy residual over 3 %%%s",
                      times, times <= 1 ? ", and this one is sound" : ""),
               (sound || named) && (times > 1 || (sound && !named)),
               Format("%s, residual %.2g, dissipation off by %.2g",
                      f.fault.empty() ? "no fault" : f.fault.c_str(), f.residual, off));
  }
  const Fall gross = FallAt(20);
  rows.Holds("20 times the critical step is seen to have failed",
             !gross.fault.empty() || !(std::abs(gross.residual) < 0.03),
             gross.fault.empty() ? Format("residual %.2g", gross.residual) : gross.fault);
}

void FastImpact(Rows& rows) {
  const double r = 0.005, v = 50;
  World hard(Cell(Model({}, {1e9, 0.3}, {.restitution = 0.8, .friction = 0.3}), 0.1, 1e-7),
             Scene({{0.05, 0.05, 1.5 * r, r, 2500, 0, 0, -v}}, {Floor()}));
  const double e = Follow(hard).after.v_z / v;
  rows.Holds("a stiff grain strikes a wall at 50 m/s: restitution 0.8 to 1 %",
             std::abs(e / 0.8 - 1) < 0.01, e);
  World soft(Cell(Model({}, {1e5, 0.3}, {.restitution = 0.8, .friction = 0.3}), 0.1, 1e-6),
             Scene({{0.05, 0.05, 1.5 * r, r, 2500, 0, 0, -v}}, {Floor()}));
  const StepFault fault = soft.Run(2000);
  rows.Holds("one too soft for it goes through the wall: a fault is named, not averaged over",
             fault != StepFault::kNone, Explain(fault));
  World pair(Cell(Model({}, {1e5, 0.3}, {.restitution = 0.8, .friction = 0.3}), 0.1, 1e-6),
             {{0.05, 0.05, 1.5 * r, r, 2500, 0, 0, -v}, {0.05, 0.05, -1.5 * r, r, 2500, 0, 0, v}});
  const StepFault through = pair.Run(2000);
  rows.Holds("two such grains go through each other: a fault is named", through != StepFault::kNone,
             Explain(through));
}

void DeepOverlap(Rows& rows) {
  const double r = 0.005;
  WorldConfig c = Cell(Model({.rolling = "epsd"}, {1e7, 0.3},
                             {.restitution = 0.5, .friction = 0.5, .rolling_friction = 0.1}),
                       0.1, 1e-6);
  c.energy = true;
  World world(c, {{0.05, 0.05, 0.75 * r, r, 2500}, {0.05, 0.05, -0.75 * r, r, 2500}});
  world.Start();
  const EnergyBalance before = world.Balance();
  RunOrThrow(world, 4000);
  const EnergyBalance after = world.Balance();
  rows.Holds(
      "overlap of half a radius to begin with: they part with no more energy than was stored",
      after.kinetic > 0 && after.kinetic < before.stored,
      Format("%.3g of %.3g J", after.kinetic, before.stored));
  rows.Below("and the energy is accounted for to 1 %", 0.01,
             std::abs(after.Total() - before.Total()) / before.Total());
}

}  // namespace

Cases StiffCases() {
  return {{"size_ratio", Level::kDefault, SizeRatio},
          {"stiffness_ratio", Level::kQuick, StiffnessRatio},
          {"steps", Level::kQuick, Steps},
          {"impact_50_m_per_s", Level::kQuick, FastImpact},
          {"deep_overlap", Level::kQuick, DeepOverlap}};
}

}  // namespace grouser::dem::verify
