// The same bits: again, on more threads, beside others, on other instruction
// sets, and as they were when this was written.
#include <algorithm>
#include <cstring>
#include <thread>

#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

/// Hash after `steps` of a bed that falls under a turning wheel.
std::uint64_t RunScene(const Laws& laws, int threads, int steps, std::uint64_t seed = 1) {
  BedSpec spec;
  spec.laws = laws;
  spec.seed = seed;
  WorldConfig c = spec.Config();
  c.threads = threads;
  Body wheel;
  wheel.shape = SmoothWheel(0.03, 0.04);
  wheel.motion = BodyMotion::kPrescribed;
  wheel.position_m = {0.12, 0.06, 0.13};
  wheel.velocity_m_per_s = {0.05, 0, -0.1};
  wheel.spin_rad_per_s = {0, 3, 0};
  World world(c, Scene(Grid(spec, 0, 0.24, 0, 0.12, 0, 1000), {Floor(), wheel}));
  RunOrThrow(world, steps);
  return world.Hash();
}

std::string Hex(std::uint64_t hash) {
  return Format("%016llx", static_cast<unsigned long long>(hash));
}

const Laws kSand = {.rolling = "epsd"};

void Repeats(Rows& rows) {
  ExpectCores();
  const std::uint64_t first = RunScene(kSand, 1, 1500);
  rows.Holds("a run repeated gives the same bits", RunScene(kSand, 1, 1500) == first, Hex(first));
  const std::uint64_t two = RunScene(kSand, 2, 1500), three = RunScene(kSand, 3, 1500);
  const std::uint64_t other = RunScene(kSand, 1, 1500, 2);
  rows.Holds("two threads give the bits of one", two == first, Hex(two));
  rows.Holds("three threads do, too", three == first, Hex(three));
  rows.Holds("another seed gives other bits", other != first, Hex(other));
  std::uint64_t mates[3];
  std::thread a([&] { mates[0] = RunScene(kSand, 1, 1500); });
  std::thread b([&] { mates[1] = RunScene(kSand, 1, 1500, 2); });
  mates[2] = RunScene({"linear_spring", "linear_history", "constant_torque"}, 1, 1500);
  a.join();
  b.join();
  rows.Holds("a world run beside two others gives the same bits", mates[0] == first, Hex(mates[0]));
}

/// One sweep of the kernels over a world's lists as they are: loads, then histories.
std::vector<float> Sweep(World& world, const Kernels& kernels) {
  std::vector<GrainLoad> loads(world.loads().size());
  PairList list = world.list();
  const std::vector<PairParams> params = world.config().contacts.Table();
  PairView v = {};
  v.grains = world.grains().data();
  list.Fill(v);
  const auto q = world.config().frame.Quantum();
  std::copy(q.begin(), q.end(), v.quantum);
  v.dt = static_cast<float>(world.config().dt_s);
  v.params = params.data();
  v.materials = world.config().contacts.materials();
  v.layout = world.config().contacts.layout();
  kernels.pairs(v, 0, list.blocks(), nullptr);
  kernels.sum(v, nullptr, loads.data(), 0, static_cast<std::int64_t>(loads.size()) / kLanes);
  std::vector<float> out(loads.size() * 8);
  std::memcpy(out.data(), loads.data(), out.size() * sizeof(float));
  out.insert(out.end(), list.history().begin(), list.history().end());
  return out;
}

void InstructionSets(Rows& rows) {
  ExpectCores();
  BedSpec spec;
  World world(spec.Config(), Scene(Grid(spec, 0, 0.24, 0, 0.12, 0, 1000), {Floor()}));
  RunOrThrow(world, 1500);
  const int combination = world.config().contacts.combination();
  const std::vector<float> base = Sweep(world, KernelsFor("baseline", combination, false));
  double pushed = 0;
  for (const float f : base) pushed += std::abs(static_cast<double>(f));
  int compared = 0;
  bool equal = true;
  std::string names;
  for (const char* isa : {"avx2", "avx512"}) {
    const Kernels kernels = KernelsFor(isa, combination, false);
    if (!kernels.pairs) continue;
    const std::vector<float> got = Sweep(world, kernels);
    equal = equal && std::memcmp(got.data(), base.data(), base.size() * sizeof(float)) == 0;
    ++compared;
    names += std::string(" ") + isa;
  }
  rows.Holds("forces and histories of a bed are bitwise equal on every instruction set here",
             equal && pushed > 0, compared == 0 ? "baseline alone" : "baseline" + names);
  const std::vector<float> generic = Sweep(world, KernelsFor("baseline", -1, false));
  rows.Holds("and on the generic path of the same laws",
             std::memcmp(generic.data(), base.data(), base.size() * sizeof(float)) == 0,
             "compared");
}

/// Changes when results change: EngineVersion() then changes as well. To
/// renew it run `grouser-verify torture --case pinned_hash` and copy the hash.
constexpr std::uint64_t kPinned = 0x6a5e149001b8720cull;

void PinnedHash(Rows& rows) {
  ExpectCores();
  const std::uint64_t hash = RunScene(kSand, 1, 500);
  rows.Holds("a short run ends with the hash committed in determinism_cases.cc", hash == kPinned,
             Hex(hash));
}

}  // namespace

Cases DeterminismCases() {
  return {{"same_bits", Level::kQuick, Repeats},
          {"instruction_sets", Level::kQuick, InstructionSets},
          {"pinned_hash", Level::kQuick, PinnedHash}};
}

}  // namespace grouser::dem::verify
