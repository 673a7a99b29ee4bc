#include "dem_offline/engine/verify/beds.h"

#include <algorithm>
#include <cmath>

#include "dem_offline/engine/laws/time_step.h"

namespace grouser::dem::verify {

World Gas(const Laws& laws, int n, std::uint64_t seed, bool energy, int threads) {
  const int side = static_cast<int>(std::lround(std::cbrt(n)));
  const double r = 0.005, cell = 2.6 * r, size = side * cell;
  WorldConfig c =
      Cell(Model(laws, {5e6, 0.3}, {.restitution = 0.9, .friction = 0.4, .rolling_friction = 0.1}),
           size, 2e-5);
  c.energy = energy;
  c.threads = threads;
  Random random(seed);
  Contents in;
  for (int i = 0; i < side * side * side; ++i) {
    GrainState g = {};
    g.x_m = (i % side + 0.5) * cell;
    g.y_m = (i / side % side + 0.5) * cell;
    g.z_m = (i / side / side + 0.5) * cell - 0.5 * size;
    g.radius_m = r * random.Between(0.8, 1.0);
    g.density_kg_per_m3 = 2500;
    for (double* v : {&g.v_x, &g.v_y, &g.v_z}) *v = random.Between(-1, 1);
    for (double* w : {&g.w_x, &g.w_y, &g.w_z}) *w = random.Between(-100, 100);
    in.grains.push_back(g);
  }
  return World(c, in);
}

WorldConfig BedSpec::Config() const {
  WorldConfig c;
  c.frame = {length_m, width_m, 1.2};
  c.gravity_m_per_s2 = {0, 0, -gravity};
  c.contacts = Model(laws, grains, surfaces);
  const double r = smallest_d_m / 2;
  const double rayleigh = RayleighTime(r, density, grains.youngs_modulus_pa, grains.poisson_ratio);
  const double limit = PackedLimit(c.contacts, 0.05, r, SphereMass(r, density));
  c.dt_s = step_share * std::min(0.2 * rayleigh, limit);
  return c;
}

std::vector<GrainState> Grid(const BedSpec& spec, double x0, double x1, double y0, double y1,
                             double z0, int count) {
  const double cell = 1.08 * spec.largest_d_m;
  const int nx = std::max(1, static_cast<int>((x1 - x0) / cell)),
            ny = std::max(1, static_cast<int>((y1 - y0) / cell));
  Random random(spec.seed);
  std::vector<GrainState> out;
  for (int i = 0; i < count; ++i) {
    GrainState g = {};
    const double jitter = 0.03 * cell;
    g.x_m = x0 + (i % nx + 0.5) * (x1 - x0) / nx + random.Between(-jitter, jitter);
    g.y_m = y0 + (i / nx % ny + 0.5) * (y1 - y0) / ny + random.Between(-jitter, jitter);
    g.z_m = z0 + (i / nx / ny + 0.5) * cell + random.Between(-jitter, jitter);
    g.radius_m = 0.5 * random.Between(spec.smallest_d_m, spec.largest_d_m);
    g.density_kg_per_m3 = spec.density;
    out.push_back(g);
  }
  return out;
}

std::vector<GrainState> Settle(const BedSpec& spec) {
  const double d = 0.5 * (spec.smallest_d_m + spec.largest_d_m);
  const int count =
      static_cast<int>(0.6 * spec.length_m * spec.width_m * spec.depth_m / (M_PI / 6 * d * d * d));
  WorldConfig c = spec.Config();
  c.gravity_m_per_s2 = {0, 0, -std::max(spec.gravity, 9.81)};
  World world(c, Scene(Grid(spec, 0, spec.length_m, 0, spec.width_m, 0, count), {Floor()}));
  world.SetDrag(1 - c.dt_s / 0.05);
  RunOrThrow(world, std::llround(0.5 / c.dt_s));
  std::vector<GrainState> out(count);
  for (int i = 0; i < count; ++i) {
    out[i] = world.StateOf(i);
    out[i].v_x = out[i].v_y = out[i].v_z = out[i].w_x = out[i].w_y = out[i].w_z = 0;
  }
  return out;
}

std::vector<GrainState> Steadied(std::vector<GrainState> grains, const Frame& frame) {
  const double period = 4294967296.0;
  for (GrainState& g : grains) {  // x and y are cut off, z is rounded
    g.x_m = (std::floor(g.x_m / frame.length_m * period) + 0.5) / period * frame.length_m;
    g.y_m = (std::floor(g.y_m / frame.width_m * period) + 0.5) / period * frame.width_m;
    g.z_m = std::round(g.z_m / frame.z_span_m * period) / period * frame.z_span_m;
  }
  return grains;
}

double SphereInSlab(double z, double radius, double low, double high) {
  const auto below = [&](double h) {  // volume under the plane h above the centre
    h = std::clamp(h, -radius, radius);
    return M_PI * (radius * radius * (h + radius) - (h * h * h + radius * radius * radius) / 3);
  };
  return below(high - z) - below(low - z);
}

double Restlessness(const World& world) {
  double weight = 0, kinetic = 0;
  const Vec3d& g = world.config().gravity_m_per_s2;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const Grain& b = world.grains()[i];
    weight += static_cast<double>(b.mass) * 2 * b.radius;
    const GrainState s = world.State(i);
    kinetic += 0.5 * b.mass * (s.v_x * s.v_x + s.v_y * s.v_y + s.v_z * s.v_z);
  }
  return kinetic / (weight * std::hypot(g[0], g[1], g[2]));
}

double Top(const World& world) {
  double top = -1e300;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const GrainState b = world.State(i);
    top = std::max(top, b.z_m + b.radius_m);
  }
  return top;
}

}  // namespace grouser::dem::verify
