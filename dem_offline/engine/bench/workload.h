#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dem_offline/engine/bench/bed.h"
#include "dem_offline/engine/rig/steady.h"
#include "dem_offline/engine/world/world.h"

// Timings of the engine that a peer can repeat on the same bed.

namespace grouser::dem::gpu {
class Device;
}

namespace grouser::dem::bench {

struct BenchOptions {
  std::string workload = "bed";  ///< "bed", "shear" or "wheel"
  std::int64_t particles = 20000;
  int cores = 1;
  std::string device = "cpu";  ///< "cuda", or "emulated": its bodies on one CPU thread
  BenchLaws laws;
  std::string order = "sorted";  ///< or "shuffled": of the grains given to the engine
  int worlds = 1;
  std::int64_t steps = 2000;  ///< timed
  std::int64_t warmup = 200;  ///< untimed, before
  int repeat = 3;
  std::uint64_t seed = 1;
  double preparation_friction = 0.1;  ///< of a bed that is made: less packs more contacts
  std::string bed;          ///< file: read if it is there, else made and written. Empty: made
  int physics_samples = 1;  ///< instants, the last at the end, evenly spread, outside of the clock
  std::string scene = "full";  ///< "wheel": "full", or "needed": window, freezing, largest step
  std::string series;          ///< "wheel": file for the forces; empty: none
  int wheel_sides = 0;         ///< "wheel": of a prism, a closed mesh; 0: round
  double skin_m = 0;           ///< of the lists; 0: the engine's own choice
};

/// Calls f(name, field, help) for every option of a command line.
template <class F>
void ForEachOption(BenchOptions& o, F&& f) {
  f("--workload", o.workload, "bed, shear or wheel");
  f("--particles", o.particles, "Grains of a world");
  f("--cores", o.cores, "Threads, of one world or one a world");
  f("--device", o.device, "cpu, cuda, or emulated");
  f("--order", o.order, "Of the grains given to the engine: sorted or shuffled");
  f("--worlds", o.worlds, "Worlds at a time");
  f("--tangential", o.laws.tangential, "Tangential law of the contacts");
  f("--rolling", o.laws.rolling, "Rolling law of the contacts");
  f("--steps", o.steps, "Timed steps");
  f("--warmup", o.warmup, "Untimed steps before");
  f("--repeat", o.repeat, "Times; the median counts");
  f("--seed", o.seed, "Of the bed");
  f("--preparation-friction", o.preparation_friction, "Of a bed that is made");
  f("--bed", o.bed, "File of the bed: read, or made and written");
  f("--physics-samples", o.physics_samples, "Instants at which overlaps and stresses are taken");
  f("--skin", o.skin_m, "Of the lists [m]; 0: the engine's own choice");
  f("--scene", o.scene, "wheel: full, or needed (window, freezing, largest step)");
  f("--wheel-sides", o.wheel_sides, "wheel: of a prism, a closed mesh; 0: round");
  f("--series", o.series, "wheel: file for the forces");
}

/// Where the stopping rule of wheel tests (rig/steady.h) ends a series, and what it says.
struct WheelVerdict {
  bool stopped = false;           ///< false: the series ended first
  double from_s = 0, time_s = 0;  ///< of the window's beginning and end
  std::string drifting;           ///< what still drifts; empty: nothing
  double travel_m = 0, contact_length_m = 0;
  BlockMean f_x_n, f_y_n, f_z_n, torque_n_m, sinkage_m;
};

/// Wall time of a part of the step, summed over worlds and timed steps.
struct BenchPhase {
  std::string name;
  double seconds = 0;
};

struct BenchResult {
  BenchOptions options;
  std::string isa;
  int threads_per_world = 1;
  std::int64_t particles = 0, free_particles = 0;  ///< per world
  double dt_s = 0;
  std::vector<double> rates;   ///< [repeat] particle-steps/s, all worlds together
  std::vector<double> cpu_s;   ///< [repeat] of all threads: under cores x wall where others ran
  std::vector<double> wall_s;  ///< [repeat] of the timed steps
  double contacts_per_particle = 0;  ///< contacts, with bodies too, that a grain has
  double rebuilds = 0;               ///< of the lists, per world, while timed
  std::vector<BenchPhase> phases;
  double bytes_per_particle_step = 0;
  double copy_bytes_per_s = 0;  ///< read and written, by as many threads, or by the device
  double device_bytes = 0;      ///< of its memory that all worlds take
  Physics physics;              ///< mean over the samples, of the first world
  WheelVerdict wheel;           ///< "wheel"
  double inertial_number = 0;   ///< "shear": rate x d sqrt(density/stress_zz)

  double Rate() const;  ///< median
  double ShareOfCopyRate() const;
};

std::vector<BenchPhase> PhasesOf(const Phases& phases);

/// Throws std::invalid_argument by option for what it cannot do ("cuda", say),
/// std::runtime_error where the simulation fails.
BenchResult RunBench(const BenchOptions& options);
void CheckOptions(const BenchOptions& options);
/// The bed of these options in their order: from the file if there, else made.
Bed OpenBed(const BenchOptions& options);

/// One repetition of "bed" or "shear" on a device.
void RunOnDevice(const Bed& bed, gpu::Device& device, BenchResult* result);
double DeviceCopyRate(gpu::Device& device, const std::string& name);

/// Wall clock [s].
double Now();

/// Bytes read and written per second when `threads` copy arrays far larger than any cache.
double CopyRate(int threads);

/// One object with the keys of docs/performance.md; and the same for people.
std::string ToJson(const BenchResult& result);
std::string ToJson(const WheelVerdict& verdict);
std::string ToText(const BenchResult& result);

}  // namespace grouser::dem::bench
