#include "dem_offline/engine/bench/workload.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <limits>
#include <memory>
#include <stdexcept>
#include <thread>

#include "dem_offline/engine/bench/wheel.h"
#include "dem_offline/engine/gpu/device.h"
#include "dem_offline/engine/rig/work.h"

namespace grouser::dem::bench {
namespace {

constexpr double kWheelGrain = 0.0065;  // [m] mean diameter of the wheel's soil

void Expect(bool ok, const char* option, const std::string& got, const char* expected) {
  if (!ok) throw std::invalid_argument(std::string(option) + ": " + got + ", expected " + expected);
}

double CpuTime() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// W worlds on C threads: a world each where there are enough, else all
/// threads in one world after another.
class Worlds {
 public:
  Worlds(const BenchOptions& o, const Bed& bed) {
    teams_ = o.worlds >= o.cores ? o.cores : 1;
    threads_ = o.worlds >= o.cores ? 1 : o.cores;
    WorldConfig config = BenchConfig(bed, threads_, o.laws);
    config.skin_m = o.skin_m;
    for (int w = 0; w < o.worlds; ++w) {
      worlds_.push_back(std::make_unique<World>(config, BenchContents(bed)));
      worlds_.back()->SetTiming(true);
      worlds_.back()->Start();
    }
  }
  /// Wall time [s].
  double Run(std::int64_t steps) {
    const double start = Now();
    std::vector<std::thread> team;
    for (int t = 1; t < teams_; ++t) team.emplace_back([this, t, steps] { RunOf(t, steps); });
    RunOf(0, steps);
    for (std::thread& t : team) t.join();
    const double wall = Now() - start;
    for (const auto& w : worlds_) {
      if (w->fault() != StepFault::kNone) {
        throw std::runtime_error(std::string("bench: ") + Explain(w->fault()));
      }
    }
    return wall;
  }
  int threads() const { return threads_; }
  const World& operator[](std::size_t w) const { return *worlds_[w]; }
  const std::vector<std::unique_ptr<World>>& all() const { return worlds_; }

 private:
  void RunOf(int team, std::int64_t steps) {
    for (std::size_t w = team; w < worlds_.size(); w += teams_) worlds_[w]->Run(steps);
  }
  int teams_, threads_;
  std::vector<std::unique_ptr<World>> worlds_;
};

std::vector<BenchPhase> SumOfPhases(const Worlds& worlds) {
  std::vector<BenchPhase> out = PhasesOf(Phases{});
  for (const auto& w : worlds.all()) {
    const std::vector<BenchPhase> one = PhasesOf(w->phases());
    for (std::size_t k = 0; k < out.size(); ++k) out[k].seconds += one[k].seconds;
  }
  return out;
}

void AddPhysics(const World& world, const Bed& bed, int samples, Physics* mean) {
  const Physics p = Measure(world, StressVolume(bed));
  mean->mean_overlap_over_radius += p.mean_overlap_over_radius / samples;
  mean->coordination += p.coordination / samples;
  mean->stress_zz_pa += p.stress_zz_pa / samples;
  mean->stress_xz_pa += p.stress_xz_pa / samples;
  mean->contacts = p.contacts;
}

/// One repetition, from the bed on: every one does the same work.
void RunOnce(const Bed& bed, BenchResult* out) {
  const BenchOptions& o = out->options;
  Worlds worlds(o, bed);
  out->threads_per_world = worlds.threads();
  worlds.Run(o.warmup);
  const std::vector<BenchPhase> before = SumOfPhases(worlds);
  const std::uint64_t rebuilds = worlds[0].rebuilds();
  out->physics = {};
  double wall = 0, cpu = 0;
  for (int k = 0; k < o.physics_samples; ++k) {
    const double cpu_before = CpuTime();
    wall += worlds.Run(o.steps * (k + 1) / o.physics_samples - o.steps * k / o.physics_samples);
    cpu += CpuTime() - cpu_before;
    AddPhysics(worlds[0], bed, o.physics_samples, &out->physics);
  }
  out->wall_s.push_back(wall);
  out->cpu_s.push_back(cpu);
  out->rates.push_back(static_cast<double>(out->particles) * o.worlds *
                       static_cast<double>(o.steps) / wall);
  out->phases = SumOfPhases(worlds);
  for (std::size_t k = 0; k < before.size(); ++k) out->phases[k].seconds -= before[k].seconds;
  out->rebuilds = static_cast<double>(worlds[0].rebuilds() - rebuilds);
  out->contacts_per_particle = worlds[0].MeanContacts();
  out->bytes_per_particle_step = worlds[0].BytesPerStep() / static_cast<double>(out->particles);
}

}  // namespace

std::vector<BenchPhase> PhasesOf(const Phases& p) {
  return {{"search", p.search_s}, {"refresh", p.prune_s}, {"pairs", p.pairs_s},
          {"sum", p.sum_s},       {"drift", p.drift_s},   {"bodies", p.bodies_s}};
}

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double BenchResult::Rate() const {
  std::vector<double> sorted = rates;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t n = sorted.size();
  return n == 0 ? 0 : 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
}

double BenchResult::ShareOfCopyRate() const {
  return copy_bytes_per_s > 0 ? bytes_per_particle_step * Rate() / copy_bytes_per_s : 0;
}

void CheckOptions(const BenchOptions& o) {
  Expect(o.workload == "bed" || o.workload == "shear" || o.workload == "wheel", "workload",
         o.workload, "bed, shear or wheel");
  Expect(o.scene == "full" || o.scene == "needed", "scene", o.scene, "full or needed");
  Expect(o.workload != "wheel" || (o.cores == 1 && o.worlds == 1), "cores and worlds",
         std::to_string(o.cores) + " and " + std::to_string(o.worlds), "1 and 1 for a wheel");
  Expect(o.device == "cpu" || o.device == "cuda" || o.device == "emulated", "device", o.device,
         "cpu, cuda or emulated");
  Expect(o.device == "cpu" || o.workload != "wheel", "device", o.device,
         "cpu for a wheel: this one moves as the peers can, not as the rig");
  Expect(o.order == "sorted" || o.order == "shuffled", "order", o.order, "sorted or shuffled");
  constexpr std::int64_t kAny = std::numeric_limits<std::int64_t>::max();
  const struct {
    const char* option;
    std::int64_t value, least, most;
  } counts[] = {{"particles", o.particles, 1000, kAny},
                {"cores", o.cores, 1, 1024},
                {"worlds", o.worlds, 1, 1 << 20},
                {"steps", o.steps, 1, kAny},
                {"warmup", o.warmup, 0, kAny},
                {"repeat", o.repeat, 1, kAny},
                {"physics_samples", o.physics_samples, 1, o.steps}};
  for (const auto& c : counts) {
    const std::string got = std::to_string(c.value);
    Expect(c.value >= c.least, c.option, got, ("at least " + std::to_string(c.least)).c_str());
    Expect(c.value <= c.most, c.option, got, ("at most " + std::to_string(c.most)).c_str());
  }
  const double grains = static_cast<double>(o.particles) * o.worlds;
  CheckWork("particles, worlds and steps",
            {.grains = static_cast<double>(o.particles),
             .steps = (static_cast<double>(o.steps) + static_cast<double>(o.warmup)) * o.worlds *
                      o.repeat,
             .bytes = kBytesPerGrain * grains},
            {});
}

Bed OpenBed(const BenchOptions& o) {
  Bed bed;
  const bool there = !o.bed.empty() && std::filesystem::exists(o.bed);
  if (there) {
    bed = LoadBed(o.bed);
    Expect(bed.kind == o.workload, "bed", o.bed + " is a '" + bed.kind + "'",
           "the workload's kind");
    // A wheel's bed has been cut: it has fewer than were poured.
    Expect((o.workload == "wheel" || bed.source.grains == o.particles) && bed.source.seed == o.seed,
           "bed",
           o.bed + " has " + std::to_string(bed.source.grains) + " grains of seed " +
               std::to_string(bed.source.seed),
           "those of --particles and --seed");
    Expect(
        bed.source.preparation_friction == o.preparation_friction, "bed",
        o.bed + " was poured with a friction of " + std::to_string(bed.source.preparation_friction),
        "that of --preparation-friction");
  } else {
    BedSource source;
    source.grains = o.particles;
    source.seed = o.seed;
    source.preparation_friction = o.preparation_friction;
    if (o.workload == "wheel") {
      source.mean_diameter_m = kWheelGrain;
      bed = MakeWheelBed(source);
    } else {
      bed = o.workload == "shear" ? MakeShearBed(source) : MakeBed(source);
    }
    if (!o.bed.empty()) SaveBed(bed, o.bed);
  }
  if (o.order == "shuffled") Shuffle(bed, o.seed + 1);
  return bed;
}

BenchResult RunBench(const BenchOptions& options) {
  CheckOptions(options);
  const Bed bed = OpenBed(options);
  BenchResult out;
  out.options = options;
  std::unique_ptr<gpu::Device> device;
  if (options.device != "cpu") device = gpu::OpenDevice(options.device);
  out.isa = device ? device->name() : BestIsa();
  out.particles = static_cast<std::int64_t>(bed.grains.size());
  out.free_particles = bed.free_grains();
  out.dt_s = bed.dt_s;
  out.copy_bytes_per_s = device ? DeviceCopyRate(*device, options.device) : CopyRate(options.cores);
  for (int r = 0; r < options.repeat; ++r) {
    if (device) {
      RunOnDevice(bed, *device, &out);
    } else {
      bed.kind == "wheel" ? RunWheel(bed, &out) : RunOnce(bed, &out);
    }
  }
  if (bed.kind == "shear") {
    out.inertial_number = bed.shear_rate_per_s * bed.source.mean_diameter_m *
                          std::sqrt(bed.source.density_kg_per_m3 / out.physics.stress_zz_pa);
  }
  return out;
}

}  // namespace grouser::dem::bench
