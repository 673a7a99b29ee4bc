#include "dem_offline/engine/bench/wheel.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "dem_offline/engine/rig/kinematics.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/scaling.h"
#include "dem_offline/engine/rig/scene.h"
#include "dem_offline/engine/rig/steady.h"

namespace grouser::dem::bench {
namespace {

constexpr double kBedLength = 0.28, kBedWidth = 0.20;  // [m]
constexpr double kTarget = 0.02;                       // standard error of F_x, F_y over the load

/// Sums over a sample's steps.
class Sampler {
 public:
  Sampler(const WheelBench& bench, double dt_s)
      : steps_(std::max<long>(1, std::lround(bench.sample_s / dt_s))), dt_(dt_s) {}
  void Add(const Wrench& f, double sinkage_m, const Motion& motion, double time_s, Series* s) {
    const double values[] = {f.fx, f.fy, f.fz, -f.ty, sinkage_m};
    for (int k = 0; k < 5; ++k) sums_[k] += values[k];
    travel_ += std::max(std::abs(motion.v_x), std::abs(motion.rim)) * dt_;
    if (++count_ < steps_) return;
    std::vector<double>* columns[] = {&s->f_x_n, &s->f_y_n, &s->f_z_n, &s->torque_n_m,
                                      &s->sinkage_m};
    for (int k = 0; k < 5; ++k) {
      columns[k]->push_back(sums_[k] / static_cast<double>(count_));
      sums_[k] = 0;
    }
    s->time_s.push_back(time_s);
    s->travel_m.push_back(travel_);
    count_ = 0;
  }

 private:
  long steps_, count_ = 0;
  double dt_, sums_[5] = {}, travel_ = 0;
};

SteadyWindow Look(const Series& series, const WheelBench& bench) {
  const auto first = std::lower_bound(series.time_s.begin(), series.time_s.end(), bench.settle_s) -
                     series.time_s.begin();
  return FindSteady(series, static_cast<std::size_t>(first),
                    {bench.load_n, bench.wheel.radius_m, kTarget});
}

WheelVerdict VerdictOf(const Series& series, const SteadyWindow& window) {
  WheelVerdict out;
  out.stopped = window.Enough();
  if (window.last > window.first) {
    out.from_s = series.time_s[window.first];
    out.time_s = series.time_s[window.last - 1];
  }
  out.drifting = window.drifting;
  out.travel_m = window.travel_m;
  out.contact_length_m = window.contact_length_m;
  const auto mean = [&](const std::vector<double>& column) {
    return AverageBlocks(std::span(column).subspan(window.first, window.last - window.first));
  };
  out.f_x_n = mean(series.f_x_n);
  out.f_y_n = mean(series.f_y_n);
  out.f_z_n = mean(series.f_z_n);
  out.torque_n_m = mean(series.torque_n_m);
  out.sinkage_m = mean(series.sinkage_m);
  return out;
}

Series Head(const Series& s, std::size_t samples) {
  Series out;
  for (auto column : {&Series::time_s, &Series::f_x_n, &Series::f_y_n, &Series::f_z_n,
                      &Series::torque_n_m, &Series::sinkage_m, &Series::travel_m}) {
    (out.*column).assign((s.*column).begin(), (s.*column).begin() + static_cast<long>(samples));
  }
  return out;
}

Body Wheel(const WheelBench& bench, double x_m, double y_m) {
  const Motion motion = MotionAt(bench.slip, 0, bench.speed_m_per_s);
  Body wheel;
  wheel.shape = bench.sides > 0
                    ? FromMesh(std::make_shared<Mesh>(PrismWheel(bench.wheel, bench.sides)))
                    : SmoothWheel(bench.wheel.radius_m, bench.wheel.width_m);
  wheel.material = kWheelMaterial;
  wheel.motion = BodyMotion::kPrescribed;
  wheel.position_m = {x_m, y_m, bench.wheel.radius_m + bench.clearance_m};
  wheel.velocity_m_per_s = {motion.v_x, 0, -bench.load_n / bench.damper_n_s_per_m};
  wheel.spin_rad_per_s = {0, motion.rim / bench.wheel.radius_m, 0};
  return wheel;
}

}  // namespace

TriangleSoup PrismWheel(const WheelShape& wheel, int sides) {
  if (sides < 3) throw std::invalid_argument("wheel-sides: expected 0 (round) or at least 3");
  const double turn = 2 * std::numbers::pi / sides;
  const double corner = 2 * wheel.radius_m / (1 + std::cos(0.5 * turn)), half = 0.5 * wheel.width_m;
  TriangleSoup out;
  for (int k = 0; k < sides; ++k) {
    const double x = corner * std::sin(k * turn), z = corner * std::cos(k * turn);
    out.vertices.push_back({x, -half, z});
    out.vertices.push_back({x, half, z});
  }
  out.vertices.push_back({0, -half, 0});
  out.vertices.push_back({0, half, 0});
  for (int k = 0; k < sides; ++k) {
    const int a = 2 * k, b = 2 * ((k + 1) % sides), hub = 2 * sides;
    out.triangles.push_back({a, b + 1, a + 1});
    out.triangles.push_back({a, b, b + 1});
    out.triangles.push_back({hub + 1, a + 1, b + 1});
    out.triangles.push_back({hub, b, a});
  }
  return out;
}

WheelVerdict Judge(const Series& series, const WheelBench& bench) {
  WheelVerdict verdict;
  double next = bench.first_look_s;
  for (std::size_t k = 0; k < series.time_s.size(); ++k) {
    const bool last = k + 1 == series.time_s.size();
    if (series.time_s[k] < next && !last) continue;
    next += bench.look_s;
    const Series head = Head(series, k + 1);
    verdict = VerdictOf(head, Look(head, bench));
    if (verdict.stopped) break;
  }
  return verdict;
}

WheelVerdict Judge(const Series& series, double from_s, double to_s) {
  const auto at = [&](double time_s) {
    return static_cast<std::size_t>(
        std::lower_bound(series.time_s.begin(), series.time_s.end(), time_s) -
        series.time_s.begin());
  };
  SteadyWindow window;
  window.first = at(from_s);
  window.last = at(to_s);
  if (window.last < window.first + 2 * kBlocks) {
    throw std::invalid_argument("window: expected at least 16 samples");
  }
  return VerdictOf(series, window);
}

Bed MakeWheelBed(const BedSource& source) {
  BedSource r = source;
  r.length_m = kBedLength;
  r.width_m = kBedWidth;
  Bed bed = MakeBed(r);
  bed.kind = "wheel";
  // As deep as it can be cut flat everywhere.
  const double cut = bed.height_m - r.mean_diameter_m;
  std::erase_if(bed.grains, [&](const GrainState& g) { return g.z_m + g.radius_m > cut; });
  bed.height_m = cut;
  return bed;
}

Tile TileOf(const Bed& bed) {
  Tile tile;
  tile.length_m = bed.length_m;
  tile.width_m = bed.width_m;
  tile.depth_m = bed.height_m;
  tile.overlap_p99_over_radius = 0.01;
  const Frame frame = {bed.length_m, bed.width_m, TileZSpan(bed.height_m)};
  for (const GrainState& g : bed.grains) {
    tile.radius_m.push_back(static_cast<float>(g.radius_m));
    tile.position.push_back(frame.FixX(g.x_m));
    tile.position.push_back(frame.FixY(g.y_m));
    tile.position.push_back(frame.FixZ(g.z_m - bed.height_m));
  }
  tile.velocity.assign(3 * bed.grains.size(), 0.0f);
  tile.spin.assign(3 * bed.grains.size(), 0.0f);
  tile.contact_first.assign(bed.grains.size() + 1, 0);
  return tile;
}

WheelTestSpec SpecOf(const BenchOptions& options, const Bed& bed, const WheelBench& bench) {
  const BedSource& r = bed.source;
  WheelTestSpec spec;
  spec.soil.density_kg_per_m3 = r.density_kg_per_m3;
  spec.soil.youngs_modulus_pa = r.youngs_modulus_pa;
  spec.soil.poisson_ratio = r.poisson_ratio;
  spec.soil.restitution = r.restitution;
  spec.soil.friction = r.friction;
  spec.soil.rolling_friction = r.rolling_friction;
  spec.soil.contact.tangential = options.laws.tangential;
  spec.soil.contact.rolling = options.laws.rolling;
  spec.soil.contact.rolling_damping = r.rolling_damping;
  spec.soil.gravity_m_per_s2 = r.gravity_m_per_s2;
  spec.soil.sizes = {{r.mean_diameter_m * (1 - r.spread), 0.5},
                     {r.mean_diameter_m * (1 + r.spread), 0.5}};
  spec.wheel = bench.wheel;
  spec.wheel.friction = r.friction;
  spec.wheel.rolling_friction = r.rolling_friction;
  spec.wheel.restitution = r.restitution;
  spec.state.slip = bench.slip;
  spec.state.load_n = bench.load_n;
  spec.rig.bed_length_m = bed.length_m;
  spec.rig.bed_width_m = bed.width_m;
  spec.rig.bed_depth_m = bed.height_m;
  spec.rig.speed_m_per_s = bench.speed_m_per_s;
  spec.rig.max_time_s = bench.longest_s;
  if (options.scene == "needed") spec.rig.scene = ReducedDomain();
  return spec;
}

void RunWheel(const Bed& bed, BenchResult* out) {
  WheelBench bench;
  bench.sides = out->options.wheel_sides;
  const Tile tile = TileOf(bed);
  const WheelTestSpec spec = SpecOf(out->options, bed, bench);
  const double dt = spec.rig.scene.largest_step
                        ? LargestStep(spec.soil, spec.wheel, tile.overlap_p99_over_radius)
                        : bed.dt_s;
  RigScene scene(spec, tile, dt);
  World& world = scene.world();
  world.SetTiming(true);
  world.AddBody(Wheel(bench, scene.start_x_m(), 0.5 * bed.width_m));
  const Motion motion = MotionAt(bench.slip, 0, bench.speed_m_per_s);
  Sampler sampler(bench, dt);
  Series series;
  double next = bench.first_look_s, particle_steps = 0;
  const double start = Now();
  const std::clock_t cpu = std::clock();
  std::uint64_t step = 0;
  while (static_cast<double>(step) * dt < bench.longest_s) {
    Body& wheel = world.body(kWheelBody);
    scene.Follow(step, wheel.position_m);
    const StepFault fault = world.Step();
    if (fault != StepFault::kNone)
      throw std::runtime_error(std::string("wheel: ") + Explain(fault));
    const Wrench& f = world.wrench(kWheelBody);
    world.body(kWheelBody).velocity_m_per_s[2] = (f.fz - bench.load_n) / bench.damper_n_s_per_m;
    particle_steps += static_cast<double>(world.count());
    const double time = static_cast<double>(++step) * dt;
    sampler.Add(f, bench.wheel.radius_m - world.body(kWheelBody).position_m[2], motion, time,
                &series);
    if (time < next) continue;
    next += bench.look_s;
    if (Look(series, bench).Enough()) break;
  }
  const double wall = Now() - start;
  out->dt_s = dt;
  out->wall_s.push_back(wall);
  out->cpu_s.push_back(static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC);
  out->rates.push_back(particle_steps / wall);
  out->options.steps = static_cast<std::int64_t>(step);
  out->rebuilds = static_cast<double>(world.rebuilds());
  out->contacts_per_particle = world.MeanContacts();
  out->bytes_per_particle_step = world.BytesPerStep() / static_cast<double>(world.count());
  out->phases = PhasesOf(world.phases());
  out->wheel = VerdictOf(series, Look(series, bench));
  out->physics = Measure(world, StressVolume(bed));
  if (!out->options.series.empty()) SaveSeries(series, out->options.series);
}

}  // namespace grouser::dem::bench
