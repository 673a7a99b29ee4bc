// The body of the pair kernel, compiled once per instruction set: GROUSER_ISA_NS
// names the set. Instantiates nothing from the standard library, so that no
// code of a higher set can leak into the rest of the program. What evaluates a
// contact is a template argument: a compiled law combination, or the generic path.
#include "dem_offline/engine/contact/lanes.inl"

namespace grouser::dem::GROUSER_ISA_NS {
namespace {

struct alignas(64) Gap {
  float dx[L], dy[L], dz[L], d2[L], reach[L];
  std::int32_t touch[L];
};

struct alignas(64) EnergyLanes {
  float stored[L], normal[L], tangent[L], slip[L], rolling[L], plastic[L], cohesion[L];
};

template <bool kRange>
GROUSER_HD bool Distances(const Lanes& i, const Lanes& j, const float* q, float range, Gap& gap) {
  const float quantum[3] = {q[0], q[1], q[2]};
  std::int32_t any = 0;
#pragma GCC ivdep
  for (int l = 0; l < L; ++l) {
    const Separation s =
        Separate<kRange>(WrapDiff(i.x[l], j.x[l]), WrapDiff(i.y[l], j.y[l]),
                         WrapDiff(i.z[l], j.z[l]), i.radius[l] + j.radius[l], quantum, range);
    gap.dx[l] = s.dx;
    gap.dy[l] = s.dy;
    gap.dz[l] = s.dz;
    gap.d2[l] = s.d2;
    gap.reach[l] = s.reach;
    gap.touch[l] = s.touch ? 1 : 0;
    any |= gap.touch[l];
  }
  return any != 0;
}

GROUSER_HD Side SideAt(const Lanes& of, int l) {
  return {of.radius[l],
          of.mass[l],
          {of.vx[l], of.vy[l], of.vz[l]},
          {of.wx[l], of.wy[l], of.wz[l]},
          of.kind[l]};
}

template <class Law, bool kEnergy>
GROUSER_HD void BlockForces(const PairView& v, const Law& law, const Lanes& i, const Lanes& j,
                            const Gap& gap, float* history, LoadLanes& on_i, LoadLanes& on_j,
                            EnergyLanes& energy) {
  float* __restrict__ h[kMaxHistoryWords];
  const int words = law.Words();
  for (int w = 0; w < words; ++w) h[w] = history + w * L;
  const float dt = v.dt;
#pragma GCC ivdep
  for (int l = 0; l < L; ++l) {
    const Separation s = {gap.dx[l], gap.dy[l],    gap.dz[l],
                          gap.d2[l], gap.reach[l], gap.touch[l] != 0};
    float word[Law::kMostWords];
    for (int w = 0; w < words; ++w) word[w] = h[w][l];
    ContactEnergy e;
    const ContactLoads c =
        EvaluateContact(law, SideAt(i, l), SideAt(j, l), s, v.range, dt, word, &e);
    for (int w = 0; w < words; ++w) h[w][l] = word[w];
    on_i.fx[l] = c.force.x;
    on_i.fy[l] = c.force.y;
    on_i.fz[l] = c.force.z;
    on_i.deepest[l] = c.deepest;
    on_i.tx[l] = c.on_first.x;
    on_i.ty[l] = c.on_first.y;
    on_i.tz[l] = c.on_first.z;
    on_i.touching[l] = c.touching;
    on_j.fx[l] = -c.force.x;
    on_j.fy[l] = -c.force.y;
    on_j.fz[l] = -c.force.z;
    on_j.deepest[l] = c.deepest;
    on_j.tx[l] = c.on_second.x;
    on_j.ty[l] = c.on_second.y;
    on_j.tz[l] = c.on_second.z;
    on_j.touching[l] = c.touching;
    if (kEnergy) {
      energy.stored[l] += e.stored;
      energy.normal[l] += e.normal_damping;
      energy.tangent[l] += e.tangent_damping;
      energy.slip[l] += e.slip;
      energy.rolling[l] += e.rolling;
      energy.plastic[l] += e.plastic;
      energy.cohesion[l] += e.cohesion;
    }
  }
}

/// Asks for what a block further on will read and write.
GROUSER_HD void Fetch(const PairView& v, const PairBlock& block) {
  for (int l = 0; l < L; ++l) __builtin_prefetch(v.grains + block.second[l], 0);
  for (int l = 0; l < L; ++l) __builtin_prefetch(v.records + block.first_record[l], 1);
  for (int l = 0; l < L; ++l) __builtin_prefetch(v.records + block.second_record[l], 1);
}

/// Index body of the kernel: the contacts of one block.
template <class Law, bool kEnergy>
GROUSER_HD void Block(const PairView& v, const Law& law, std::int64_t number, EnergyLanes& energy) {
  PairBlock& block = v.blocks[number];
  float* const history = v.history + number * law.Words() * L;
  Fetch(v, v.blocks[number + kBlocksAhead]);
  Lanes i, j;
  Gap gap;
  LoadLanes on_i = {}, on_j = {};
  Gather(v.grains, block.first, i);
  Gather(v.grains, block.second, j);
  const bool any = Distances<Law::kRange>(i, j, v.quantum, v.range, gap);
  if (any) {
    BlockForces<Law, kEnergy>(v, law, i, j, gap, history, on_i, on_j, energy);
  } else if (block.touched) {
    for (int k = 0; k < law.Words() * L; ++k) history[k] = 0.0f;
  }
  block.touched = any ? 1 : 0;
  Scatter(on_i, block.first_record, v.records);
  Scatter(on_j, block.second_record, v.records);
}

template <class R>
OneCombination<R> LawOf(const PairView& v, const OneCombination<R>*) {
  return {R::From(v.params[0])};
}
inline AnyLaws LawOf(const PairView& v, const AnyLaws*) {
  return {v.layout, v.params, v.materials};
}

template <class Law, bool kEnergy>
void Blocks(const PairView& view, std::int64_t from, std::int64_t to, EnergySums* total) {
  const Law law = LawOf(view, static_cast<const Law*>(nullptr));
  EnergyLanes energy = {};
  for (std::int64_t b = from; b < to; ++b) Block<Law, kEnergy>(view, law, b, energy);
  if (!kEnergy) return;
  for (int l = 0; l < L; ++l) {
    total->stored += energy.stored[l];
    total->normal_damping += energy.normal[l];
    total->tangent_damping += energy.tangent[l];
    total->slip += energy.slip[l];
    total->rolling += energy.rolling[l];
    total->plastic += energy.plastic[l];
    total->cohesion += energy.cohesion[l];
  }
}

/// Index body: the sums of one grain's records.
GROUSER_HD void SumGrain(const PairView& v, std::int64_t grain, GrainLoad* loads) {
  typedef float Eight __attribute__((vector_size(32), may_alias));
  typedef std::int32_t Mask __attribute__((vector_size(32)));
  const Mask deepest = {0, 0, 0, -1, 0, 0, 0, 0};
  Eight sum = {};
  for (std::int32_t r = v.record_start[grain]; r < v.record_start[grain + 1]; ++r) {
    const Eight one = *reinterpret_cast<const Eight*>(v.records + r);
    const Eight most = sum > one ? sum : one;
    sum = deepest ? most : sum + one;
  }
  *reinterpret_cast<Eight*>(loads + grain) = sum;
}

[[maybe_unused]] void SumTiles(const PairView& v, const std::uint8_t* idle, GrainLoad* loads,
                               std::int64_t from, std::int64_t to) {
  for (std::int64_t t = from; t < to; ++t) {
    if (idle && idle[t]) continue;
    for (int l = 0; l < L; ++l) SumGrain(v, t * L + l, loads);
  }
}

template <class... R>
PairKernelFn Choose(int combination, bool energy, CombinationList<R...>) {
  static constexpr PairKernelFn plain[] = {Blocks<OneCombination<R>, false>...};
  static constexpr PairKernelFn counted[] = {Blocks<OneCombination<R>, true>...};
  return energy ? counted[combination] : plain[combination];
}

}  // namespace
}  // namespace grouser::dem::GROUSER_ISA_NS
