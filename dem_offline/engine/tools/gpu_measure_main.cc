// grouser-gpu-measure: rates of the two long jobs of docs/performance.md on a
// device, over a stated time, and what the whole would take at that rate.
// Plain program: builds on a machine that has nothing but compilers.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <thread>
#include <vector>

#include "dem_offline/engine/gpu/ensemble.h"
#include "dem_offline/engine/gpu/rig.h"
#include "dem_offline/engine/tools/options.h"

namespace {

using namespace grouser::dem;

constexpr char kUsage[] =
    "usage: grouser-gpu-measure wheels|clumps [--device cuda|emulated] [--seconds S]\n"
    "                           [--tests N] [--copies N]\n"
    "wheels: N (189) wheel tests of about 52,000 grains at once, 7 attack angles x\n"
    "        9 slips x 3 loads; 200,000 steps of all are extrapolated.\n"
    "clumps: N x N (4) copies of a bed of 38,400 members of rigid clusters under a\n"
    "        toothed wheel (4 x 4: reference 1); its 12 s at 6.7e-6 s are extrapolated.\n"
    "S (60) seconds are timed. JSON on stdout.\n";

struct Job {
  std::string device = "cuda";
  double seconds = 60;
  int tests = 189, copies = 4;
};

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

WheelTestSpec TestOf(int number) {
  WheelTestSpec s;
  s.soil.density_kg_per_m3 = 2293.1;
  s.soil.friction = 0.55;
  s.soil.rolling_friction = 0.3;
  s.soil.sizes = {{0.0072, 0.25}, {0.008, 0.5}, {0.0088, 0.25}};
  s.wheel.friction = 0.5;
  s.wheel.rolling_friction = 0.3;
  s.rig.bed_length_m = 0.3;
  s.rig.bed_width_m = 0.22;
  s.rig.bed_depth_m = 0.11;
  s.rig.rayleigh_fraction = 0.15;      // 200,000 steps are 9 s
  s.rig.max_time_s = 8.95;             // three tiles and one to start on
  s.rig.target_relative_error = 1e-6;  // nobody stops early
  s.rig.scene.bed = SceneBed::kFull;
  s.state.attack_angle_rad = number % 7 * 15 * std::numbers::pi / 180;
  s.state.slip = -0.7 + 0.2 * (number / 7 % 9);
  s.state.load_n = 12 + 8 * (number / 63 % 3);
  return s;
}

int Wheels(const Job& o, gpu::Device& device) {
  const Tile tile = PrepareBed(BedOf(TestOf(0)), {});
  std::vector<gpu::WheelJob> jobs;
  for (int n = 0; n < o.tests; ++n) jobs.push_back({TestOf(n), &tile});
  std::string memory;
  double begin = 0;
  const auto results = gpu::RunWheelTests(jobs, device, [&](double, const std::string& stage) {
    if (stage.starts_with(gpu::kMemoryStage)) {
      memory = stage.substr(std::string(gpu::kMemoryStage).size());
      begin = Now();
    }
    return Now() - begin < o.seconds;
  });
  const double took = Now() - begin;
  double particle_steps = 0, grains = 0, steps = 0;
  for (const WheelTestResult& r : results) {
    particle_steps += r.particle_steps;
    grains += static_cast<double>(r.grains);
    steps = std::max(steps, static_cast<double>(r.steps));
    if (r.stopped == StopCause::kFault)
      throw std::runtime_error("a wheel test failed: " + r.reason);
  }
  const double rate = particle_steps / took;
  std::printf(
      "{\"what\": \"wheel tests\", \"device\": \"%s\", \"tests\": %d, \"grains_each\": %.0f, "
      "\"timed_s\": %.1f, \"steps_done\": %.0f, \"particle_steps_per_s\": %.4g, "
      "\"extrapolated_minutes_for_189_x_50000_x_200000\": %.1f, \"memory\": \"%s\"}\n",
      device.name(), o.tests, grains / o.tests, took, steps, rate, 189 * 5e4 * 2e5 / rate / 60,
      memory.c_str());
  return 0;
}

/// Four spheres on a tetrahedron, together of the volume of 2.54 of them.
ClumpTemplate Cluster(double diameter) {
  const double r = diameter / 2, wanted = 2.54 * 4 / 3 * std::numbers::pi * r * r * r;
  const auto at = [r](double e) {
    return MakeClump({{{e, e, e}, r}, {{e, -e, -e}, r}, {{-e, e, -e}, r}, {{-e, -e, e}, r}});
  };
  double low = 0.05 * r, high = 0.7 * r;
  for (int k = 0; k < 40; ++k) {
    const double mid = 0.5 * (low + high);
    (at(mid).volume_m3 < wanted ? low : high) = mid;
  }
  return at(low);
}

constexpr double kLength = 0.175, kWidth = 0.065;  // a sixteenth of reference 1's road
constexpr int kLarge = 850, kSmall = 8750;

double Reach(const ClumpTemplate& shape) {
  double most = 0;
  for (const auto& m : shape.members) {
    most = std::max(most, std::sqrt(DotD(m.offset_m, m.offset_m)) + m.radius_m);
  }
  return most;
}

/// Clusters in layers, the large ones between the small.
std::vector<ClumpState> Layers() {
  std::vector<ClumpState> out;
  int left[2] = {kLarge, kSmall};
  double z = 0;
  for (int layer = 0; left[0] + left[1] > 0; ++layer) {
    int kind = layer % 4 == 0 ? 0 : 1;
    if (left[kind] == 0) kind = 1 - kind;
    const double pitch = 2.02 * Reach(Cluster(kind == 0 ? 0.005 : 0.0025));
    const int nx = static_cast<int>(kLength / pitch), ny = static_cast<int>(kWidth / pitch);
    for (int k = 0; k < nx * ny && left[kind] > 0; ++k, --left[kind]) {
      ClumpState s;
      s.shape = kind;
      s.density_kg_per_m3 = 2406;
      s.position_m = {(k % nx + 0.5) * kLength / nx, (k / nx + 0.5) * kWidth / ny, z + pitch / 2};
      const double turn = 2.4 * (k + 7 * layer);
      s.orientation = {std::cos(turn), std::sin(turn) * 0.6, std::sin(turn) * 0.8, 0};
      out.push_back(s);
    }
    z += pitch;
  }
  return out;
}

WorldConfig RoadConfig(int copies, double youngs_modulus, double dt) {
  WorldConfig c;
  c.frame = {kLength * copies, kWidth * copies, 1.0};
  c.dt_s = dt;
  c.contacts.AddMaterial({youngs_modulus, 0.3});
  c.contacts.AddMaterial({kRigid, 0.0});
  c.contacts.SetContactProperties(0, 0, {0.5, 0.4, 0.05});
  c.contacts.SetContactProperties(0, 1, {0.5, 0.4, 0.05});
  return c;
}

Contents Road(std::vector<ClumpState> clumps, int copies, double wheel_height) {
  Contents in;
  in.templates = {Cluster(0.005), Cluster(0.0025)};
  for (int k = 0; k < copies * copies; ++k) {
    for (ClumpState s : clumps) {
      s.position_m[0] += k % copies * kLength;
      s.position_m[1] += k / copies * kWidth;
      in.clumps.push_back(s);
    }
  }
  const double up[3] = {0, 0, 1};
  Body floor;
  floor.shape = HalfSpace(up);
  in.bodies = {floor};
  if (wheel_height <= 0) return in;
  Tread teeth;
  teeth.count = 16;
  teeth.height_m = 0.01;
  teeth.root_thickness_m = 0.012;
  Body wheel;
  wheel.shape = TreadedWheel(0.09, 0.1, {teeth});
  wheel.motion = BodyMotion::kPrescribed;
  wheel.position_m = {0.1, 0.5 * kWidth * copies, wheel_height};
  wheel.velocity_m_per_s = {0.01, 0, 0};
  wheel.spin_rad_per_s = {0, 0.1, 0};
  in.bodies.push_back(wheel);
  return in;
}

/// So many steps of a sixteenth of the road on these cores; all at rest then.
std::vector<ClumpState> Settle(const std::vector<ClumpState>& from, double youngs_modulus,
                               double step, double drag, int steps) {
  WorldConfig c = RoadConfig(1, youngs_modulus, step);
  c.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  World world(c, Road(from, 1, 0));
  world.SetDrag(drag);
  if (world.Run(steps) != StepFault::kNone) {
    throw std::runtime_error(std::string("settling the bed: ") + Explain(world.fault()));
  }
  std::vector<ClumpState> out;
  for (std::int64_t k = 0; k < world.clumps(); ++k) {
    out.push_back(world.Clump(k));
    out.back().velocity_m_per_s = out.back().spin_rad_per_s = {0, 0, 0};
  }
  return out;
}

/// Poured with softer clusters, which then stiffen.
std::vector<ClumpState> Pour(double* top) {
  auto bed = Settle(Layers(), 1e7, 2e-5, 0.9995, 12000);
  bed = Settle(bed, 1e8, 1e-6, 0.95, 3000);
  bed = Settle(bed, 1e8, 6.7e-6, 0.99, 1500);
  std::vector<double> heights;
  for (const ClumpState& s : bed) heights.push_back(s.position_m[2]);
  std::sort(heights.begin(), heights.end());
  *top = heights.back();
  return bed;
}

int Clumps(const Job& o, gpu::Device& device) {
  constexpr double kStep = 6.7e-6, kSimulated = 12, kMembers = 614432;
  constexpr int kAtOnce = 64;
  double top = 0;
  const auto bed = Pour(&top);
  World road(RoadConfig(o.copies, 1e8, kStep), Road(bed, o.copies, top + 0.1035));
  road.SetDrag(0.999);  // what is left of the pouring
  gpu::Ensemble all({&road}, device);
  const auto steps_for = [&](double seconds) {
    const double begin = Now();
    std::int64_t steps = 0;
    for (; Now() - begin < seconds; steps += kAtOnce) all.Run(kAtOnce);
    if (all.fault(0) != StepFault::kNone) throw std::runtime_error(Explain(all.fault(0)));
    return static_cast<double>(steps) / (Now() - begin);
  };
  steps_for(0.1 * o.seconds);
  const double rate = steps_for(o.seconds), members = static_cast<double>(road.count());
  double touching = 0;
  for (const GrainLoad& f : all.Loads(0)) touching += f.touching;
  std::printf(
      "{\"what\": \"clusters under a wheel\", \"device\": \"%s\", \"members\": %.0f, "
      "\"bed_height_m\": %.4f, \"contacts_per_member\": %.2f, \"timed_s\": %.1f, "
      "\"steps_per_s\": %.4g, \"particle_steps_per_s\": %.4g, "
      "\"extrapolated_hours_for_12_s_of_614432\": %.3f, \"memory\": \"%s\"}\n",
      device.name(), members, top, touching / members, o.seconds, rate, rate * members,
      kSimulated / kStep * kMembers / (rate * members) / 3600, gpu::ToText(all.Plan()).c_str());
  return 0;
}

int Main(int argc, char** argv) {
  Job job;
  Options options;
  options.Value("--device", &job.device);
  options.Value("--seconds", &job.seconds);
  options.Value("--tests", &job.tests);
  options.Value("--copies", &job.copies);
  options.Parse(argc, argv, 2);
  const std::string what = argc < 2 ? "" : argv[1];
  if ((what != "wheels" && what != "clumps") || !(job.seconds > 0) || job.tests < 1 ||
      job.copies < 1) {
    throw std::invalid_argument("expected wheels or clumps, and numbers above 0");
  }
  const auto device = gpu::OpenDevice(job.device);
  return what == "wheels" ? Wheels(job, *device) : Clumps(job, *device);
}

}  // namespace

int main(int argc, char** argv) {
  return RunProgram("grouser-gpu-measure", kUsage, argc, argv, Main);
}
