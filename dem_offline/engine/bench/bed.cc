#include "dem_offline/engine/bench/bed.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "dem_offline/engine/core/random.h"

namespace grouser::dem::bench {
namespace {

constexpr double kSolidFraction = 0.6;    // of what was poured, for the size of the box
constexpr double kMostDepth = 20;         // [diameters]
constexpr double kDragTime = 0.05;        // [s] of the viscous fall
constexpr double kStiffDragTime = 0.02;   // [s] while it comes to rest
constexpr double kAlmost = 1e-2;          // kinetic energy over m g d: has fallen
constexpr double kQuiet = 1e-4;           // is at rest
constexpr int kForgettings = 4;           // times that histories are dropped before the bed is kept
constexpr double kForgettingTime = 0.04;  // [s] to come to rest again after each

double MeanVolume(const BedSource& r) {
  return M_PI / 6 * std::pow(r.mean_diameter_m, 3) * (1 + r.spread * r.spread);
}

void SizeBox(const BedSource& r, Bed* bed) {
  const double bulk = static_cast<double>(r.grains) * MeanVolume(r) / kSolidFraction;
  const double depth = std::min(kMostDepth * r.mean_diameter_m, std::cbrt(bulk));
  bed->length_m = r.length_m > 0 ? r.length_m : std::sqrt(bulk / depth);
  bed->width_m = r.width_m > 0 ? r.width_m : std::sqrt(bulk / depth);
}

/// A jittered lattice, just wide enough that nothing touches.
std::vector<GrainState> Loose(const BedSource& r, const Bed& bed) {
  Random random = RandomOfSeed(r.seed);
  const double largest = r.mean_diameter_m * (1 + r.spread), pitch = 1.02 * largest;
  const int nx = std::max(1, static_cast<int>(bed.length_m / pitch)),
            ny = std::max(1, static_cast<int>(bed.width_m / pitch));
  std::vector<GrainState> out(r.grains);
  for (std::int64_t i = 0; i < r.grains; ++i) {
    GrainState& g = out[i];
    g = {};
    g.radius_m = 0.5 * r.mean_diameter_m * (1 + r.spread * (2 * random.Uniform() - 1));
    g.density_kg_per_m3 = r.density_kg_per_m3;
    const double play = 0.5 * pitch - g.radius_m;
    const auto jitter = [&] { return play * (2 * random.Uniform() - 1); };
    const auto layer = i / nx / ny;
    const double shift = layer % 2 ? 0.5 : 0.0;
    g.x_m = (static_cast<double>(i % nx) + 0.5 + shift) * bed.length_m / nx + jitter();
    g.y_m = (static_cast<double>(i / nx % ny) + 0.5 + shift) * bed.width_m / ny + jitter();
    g.z_m = (static_cast<double>(layer) + 0.5) * pitch + jitter();
    const auto kick = [&] { return 0.1 * (2 * random.Uniform() - 1); };
    g.v_x = kick();
    g.v_y = kick();
  }
  return out;
}

/// Kinetic energy over m g d.
double Restlessness(const World& world, const BedSource& r) {
  double mass = 0;
  for (const Grain& g : world.grains()) mass += g.id >= 0 ? g.mass : 0;
  return world.KineticEnergy() / (mass * r.gravity_m_per_s2 * r.mean_diameter_m);
}

struct Rest {
  double drag_s, least_s, most_s, restlessness;
};

/// Runs with drag until at rest, then stops all.
void Settle(const Rest& rest, Bed* bed) {
  Bed slick = *bed;
  slick.source.friction = bed->source.preparation_friction;
  World world(BenchConfig(slick, 1), BenchContents(slick));
  world.SetDrag(1 - bed->dt_s / rest.drag_s);
  const auto least = std::llround(rest.least_s / bed->dt_s);
  const auto most = std::llround(rest.most_s / bed->dt_s);
  bool quiet = false;
  for (std::int64_t s = 0; s < most && !quiet; s += 100) {
    const StepFault fault = world.Run(100);
    if (fault != StepFault::kNone) throw std::runtime_error(std::string("bed: ") + Explain(fault));
    quiet = s >= least && Restlessness(world, bed->source) < rest.restlessness;
  }
  if (!quiet) {
    throw std::runtime_error("bed: still moving after " + std::to_string(rest.most_s) + " s");
  }
  for (std::int64_t i = 0; i < world.count(); ++i) {
    GrainState& g = bed->grains[world.grains()[i].id];
    g = world.State(i);
    g.v_x = g.v_y = g.v_z = g.w_x = g.w_y = g.w_z = 0;
  }
}

}  // namespace

std::int64_t Bed::free_grains() const {
  return std::count_if(grains.begin(), grains.end(), [](const GrainState& g) { return !g.glued; });
}

ContactModel BenchContacts(const BedSource& r, const BenchLaws& laws) {
  ContactModel model(LawsByName("hertz_restitution", laws.tangential, laws.rolling, "none"));
  const Elastic sand = {r.youngs_modulus_pa, r.poisson_ratio};
  const ContactProperties surfaces = {.restitution = r.restitution,
                                      .friction = r.friction,
                                      .rolling_friction = r.rolling_friction,
                                      .rolling_damping = r.rolling_damping};
  model.AddMaterial(sand);
  model.AddMaterial(sand);
  for (const int other : {0, 1}) model.SetContactProperties(0, other, surfaces);
  model.SetContactProperties(1, 1, surfaces);
  return model;
}

double BenchStep(const BedSource& r) {
  return r.rayleigh_fraction * RayleighTime(0.5 * r.mean_diameter_m * (1 - r.spread),
                                            r.density_kg_per_m3, r.youngs_modulus_pa,
                                            r.poisson_ratio);
}

WorldConfig BenchConfig(const Bed& bed, int threads, const BenchLaws& laws) {
  WorldConfig c;
  // The span holds what is poured loosely, twice as high as the bed.
  c.frame = {bed.length_m, bed.width_m, 256 * bed.source.mean_diameter_m};
  c.gravity_m_per_s2 = {0, 0, bed.kind == "shear" ? 0.0 : -bed.source.gravity_m_per_s2};
  c.dt_s = bed.dt_s;
  c.contacts = BenchContacts(bed.source, laws);
  c.threads = threads;
  return c;
}

Contents BenchContents(const Bed& bed) {
  Contents in;
  in.grains = bed.grains;
  if (bed.kind == "shear") return in;
  Body floor;
  const double up[3] = {0, 0, 1};
  floor.shape = HalfSpace(up);
  in.bodies.push_back(floor);
  return in;
}

Bed MakeBed(const BedSource& r) {
  if (r.grains < 100) throw std::invalid_argument("particles: expected at least 100");
  Bed bed;
  bed.kind = "bed";
  bed.source = r;
  bed.dt_s = BenchStep(r);
  SizeBox(r, &bed);
  bed.grains = Loose(r, bed);
  double top = 0;
  for (const GrainState& g : bed.grains) top = std::max(top, g.z_m);
  const double fall = std::sqrt(top / r.gravity_m_per_s2);
  Settle({kDragTime, 0.5 * fall, 10 * fall + 1, kAlmost}, &bed);
  for (int k = 0; k < kForgettings; ++k) Settle({kStiffDragTime, kForgettingTime, 1, kQuiet}, &bed);
  SortInSpace(bed);
  double moment = 0, mass = 0;
  for (const GrainState& g : bed.grains) {
    moment += g.mass_kg * g.z_m;
    mass += g.mass_kg;
  }
  bed.height_m = 2 * moment / mass;
  return bed;
}

void SortInSpace(Bed& bed) {
  const double cell = 3 * bed.source.mean_diameter_m;
  const auto key = [&](const GrainState& g) {
    return std::array{static_cast<int>(g.x_m / cell), static_cast<int>(g.y_m / cell),
                      static_cast<int>(g.z_m / cell)};
  };
  std::stable_sort(bed.grains.begin(), bed.grains.end(),
                   [&](const GrainState& a, const GrainState& b) { return key(a) < key(b); });
}

void Shuffle(Bed& bed, std::uint64_t seed) {
  Random random = RandomOfSeed(seed);
  for (std::size_t i = bed.grains.size(); i > 1; --i) {
    std::swap(bed.grains[i - 1], bed.grains[random.Next() % i]);
  }
}

}  // namespace grouser::dem::bench
