// Random packings: Agnolin & Roux, Phys. Rev. E 76 (2007) 061302. A granular
// gas is compressed to a small pressure, here between a floor and a piston of
// a cell that is periodic sideways; the middle is measured.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

constexpr double kPackedDiameter = 0.01, kPackedDensity = 2500, kPressure = 1000,
                 kPackedSide = 11 * kPackedDiameter;

struct Packing {
  double solid_fraction = 0, coordination = 0, rattlers = 0;
};

std::vector<GrainState> LooseGas(int count, double fraction, std::uint64_t seed) {
  const double height =
      count * M_PI / 6 * std::pow(kPackedDiameter, 3) / fraction / (kPackedSide * kPackedSide);
  const int n = static_cast<int>(kPackedSide / kPackedDiameter);
  const int layers = (count + n * n - 1) / (n * n);
  Random random(seed);
  std::vector<GrainState> out;
  const double speed = 0.3;
  for (int i = 0; i < count; ++i) {
    GrainState g = {};
    g.x_m = (i % n + 0.5) * kPackedSide / n;
    g.y_m = (i / n % n + 0.5) * kPackedSide / n;
    g.z_m = (i / n / n + 0.5) * height / layers;
    g.radius_m = kPackedDiameter / 2;
    g.density_kg_per_m3 = kPackedDensity;
    for (double* v : {&g.v_x, &g.v_y, &g.v_z}) *v = random.Between(-speed, speed);
    out.push_back(g);
  }
  return out;
}

/// Rattlers carry nothing: grains with fewer than `least` contacts with grains
/// that carry, taken away until none is left. Their contacts do not count.
std::vector<int> CarryingContacts(const World& world, int least) {
  std::vector<std::vector<std::int32_t>> touches(world.count());
  world.list().ForEachHistory([&](std::int32_t i, std::int32_t j, const float*) {
    touches[i].push_back(j);
    touches[j].push_back(i);
  });
  std::vector<int> contacts(world.count());
  for (std::int64_t i = 0; i < world.count(); ++i) {
    contacts[i] = static_cast<int>(world.loads()[i].touching);  // walls carry as well
  }
  for (bool again = true; again;) {
    again = false;
    for (std::int64_t i = 0; i < world.count(); ++i) {
      if (contacts[i] == 0 || contacts[i] >= least) continue;
      contacts[i] = 0;
      again = true;
      for (const std::int32_t j : touches[i]) contacts[j] = std::max(0, contacts[j] - 1);
    }
  }
  return contacts;
}

Packing PackingOf(const World& world, double low, double high, int least) {
  Packing out;
  double volume = 0;
  std::int64_t inside = 0, loose = 0;
  double touching = 0;
  const std::vector<int> contacts = CarryingContacts(world, least);
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const GrainState g = world.State(i);
    volume += SphereInSlab(g.z_m, g.radius_m, low, high);
    if (g.z_m < low || g.z_m > high) continue;
    ++inside;
    loose += contacts[i] == 0 ? 1 : 0;
    touching += contacts[i];
  }
  out.solid_fraction = volume / (kPackedSide * kPackedSide * (high - low));
  out.coordination = touching / static_cast<double>(inside - loose);
  out.rattlers = static_cast<double>(loose) / static_cast<double>(inside);
  return out;
}

/// kappa = (E/((1 - nu^2) P))^(2/3): overlaps are about d/kappa. Contacts grow with the overlap,
/// and published ones are for little pressure: kStiffKappa is nearer to that limit, and our choice.
constexpr double kSoftKappa = 6000, kStiffKappa = 39000;

/// Thermalised at constant volume, then compressed by a piston that is pushed
/// by the pressure but no faster than `inertial` allows.
Packing Compress(double friction, int count, double inertial, std::uint64_t seed,
                 double kappa = kSoftKappa) {
  const double modulus = std::pow(kappa, 1.5) * 0.91 * kPressure;
  const double dt = 1.7e-5 * std::sqrt(kSoftKappa / kappa);
  ContactModel model = Model({.settings = {{"hertz_restitution", "critical_damping_share", 0.98}}},
                             {modulus, 0.3}, {.restitution = 0.5, .friction = friction});
  WorldConfig c = Cell(model, kPackedSide, dt);
  c.frame.z_span_m = 2;
  std::vector<GrainState> grains = LooseGas(count, 0.45, seed);
  const double height =
      count * M_PI / 6 * std::pow(kPackedDiameter, 3) / 0.45 / (kPackedSide * kPackedSide);
  Body piston = Plane({0, 0, -1}, {0, 0, height});
  piston.motion = BodyMotion::kPrescribed;
  World world(c, Scene(grains, {Floor(), piston}));
  const double unit =
      std::sqrt(SphereMass(kPackedDiameter / 2, kPackedDensity) / (kPackedDiameter * kPressure));
  const double fastest = inertial / unit * height, area = kPackedSide * kPackedSide;
  const double gain = 0.2 * fastest;  // of the servo
  const auto compress = [&](double seconds) {
    for (double t = 0; t < seconds; t += dt) {
      const double short_of = 1 - world.wrench(1).fz / (kPressure * area);
      world.body(1).velocity_m_per_s = {0, 0, -std::clamp(short_of * gain * 5, -fastest, fastest)};
      RunOrThrow(world, 1);
    }
  };
  RunOrThrow(world, std::llround(0.15 / dt));  // collisions mix the grid
  compress(0.36 / inertial * unit);
  world.SetDrag(1 - dt / (4 * unit));
  compress(60 * unit);
  const double top = world.body(1).position_m[2];
  return PackingOf(world, 4 * kPackedDiameter, top - 4 * kPackedDiameter, friction > 0 ? 2 : 4);
}

constexpr char kPackingSource[] = "Agnolin & Roux 2007";

void Frictionless(Rows& rows) {
  const Packing p = Compress(0, 3000, 3e-3, 1);
  rows.Absolute("solid fraction without friction [-]", 0.639, p.solid_fraction, 0.01,
                kPackingSource);
  rows.Absolute("contacts per grain that carries [-]", 6.0, p.coordination, 0.15,
                "isostatic; Agnolin & Roux 2007");
}

void Frictional(Rows& rows) {
  const Packing p = Compress(0.3, 3000, 3e-3, 1, kStiffKappa);
  rows.Absolute("solid fraction with friction 0.3 [-]", 0.593, p.solid_fraction, 0.01,
                kPackingSource);
  rows.Absolute("contacts per grain that carries [-]", 4.5, p.coordination, 0.25, kPackingSource);
}

/// What the size of the cell and the rate of compression do to both.
void Convergence(Rows& rows) {
  for (const double friction : {0.0, 0.3}) {
    const double expected = friction == 0 ? 0.639 : 0.593;
    const Packing slow = Compress(friction, 3000, 1e-3, 1),
                  large = Compress(friction, 6000, 3e-3, 2);
    rows.Absolute(Format("friction %g: solid fraction, 1/3 of the rate [-]", friction), expected,
                  slow.solid_fraction, 0.01, kPackingSource);
    rows.Absolute(Format("friction %g: solid fraction, twice the grains [-]", friction), expected,
                  large.solid_fraction, 0.01, kPackingSource);
  }
  rows.Absolute("contacts per grain that carries, softer: overlaps of d/6000 [-]", 4.5,
                Compress(0.3, 3000, 3e-3, 1).coordination, 0.25, kPackingSource);
}

}  // namespace

Cases PackingCases() {
  return {{"packing_frictionless", Level::kDefault, Frictionless},
          {"packing_frictional", Level::kDefault, Frictional},
          {"packing_convergence", Level::kFull, Convergence}};
}

}  // namespace grouser::dem::verify
