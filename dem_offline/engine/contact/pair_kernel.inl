// The body of the pair kernel, compiled once per instruction set: GROUSER_ISA_NS
// names the set. Instantiates nothing from the standard library, so that no
// code of a higher set can leak into the rest of the program. What evaluates a
// contact is a template argument: a recipe of the menu, or the generic path.
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

/// Distances; the wrapped difference is the minimum image.
template <bool kRange>
GROUSER_HD bool Distances(const Lanes& i, const Lanes& j, const float* q, float range, Gap& gap) {
  const float qx = q[0], qy = q[1], qz = q[2];
  std::int32_t any = 0;
#pragma GCC ivdep
  for (int l = 0; l < L; ++l) {
    const auto ix = static_cast<std::int32_t>(static_cast<std::uint32_t>(i.x[l]) -
                                              static_cast<std::uint32_t>(j.x[l]));
    const auto iy = static_cast<std::int32_t>(static_cast<std::uint32_t>(i.y[l]) -
                                              static_cast<std::uint32_t>(j.y[l]));
    const auto iz = static_cast<std::int32_t>(static_cast<std::uint32_t>(i.z[l]) -
                                              static_cast<std::uint32_t>(j.z[l]));
    gap.dx[l] = static_cast<float>(ix) * qx;
    gap.dy[l] = static_cast<float>(iy) * qy;
    gap.dz[l] = static_cast<float>(iz) * qz;
    gap.d2[l] = gap.dx[l] * gap.dx[l] + gap.dy[l] * gap.dy[l] + gap.dz[l] * gap.dz[l];
    gap.reach[l] = i.radius[l] + j.radius[l];
    const float far = kRange ? gap.reach[l] + range : gap.reach[l];
    const std::int32_t near = gap.d2[l] < far * far ? 1 : 0;
    gap.touch[l] = gap.d2[l] > 0.0f ? near : 0;
    any |= gap.touch[l];
  }
  return any != 0;
}

/// a b/(a + b); the same bits for (b, a), and no product to underflow.
GROUSER_HD float Harmonic(float a, float b) {
  const float most = Max(a, b), least = Min(a, b);
  return most * (least / (least + most));
}

/// One contact as its first side sees it; a lane that does not touch gets a
/// harmless geometry and is masked afterwards.
template <bool kRange>
GROUSER_HD ContactGeometry Geometry(const Lanes& i, const Lanes& j, const Gap& gap, float range,
                                    int l) {
  const bool touch = gap.touch[l] != 0;
  const float dist = Sqrt(touch ? gap.d2[l] : 1.0f);
  const float inv = 1.0f / dist;
  ContactGeometry g;
  g.n = {gap.dx[l] * inv, gap.dy[l] * inv, gap.dz[l] * inv};
  g.overlap = touch ? gap.reach[l] - dist : 1e-9f;
  if (!kRange || range == 0.0f) g.overlap = Max(g.overlap, 1e-12f);
  g.r_own = i.radius[l];
  g.r_other = j.radius[l];
  const float li = g.r_own - 0.5f * g.overlap, lj = g.r_other - 0.5f * g.overlap;
  const Vec3f wi = {i.wx[l], i.wy[l], i.wz[l]}, wj = {j.wx[l], j.wy[l], j.wz[l]};
  const Vec3f dv = {i.vx[l] - j.vx[l], i.vy[l] - j.vy[l], i.vz[l] - j.vz[l]};
  g.v_rel = dv - Cross(li * wi + lj * wj, g.n);
  g.w_rel = wi - wj;
  g.w_own = wi;
  const float mi = i.mass[l], mj = j.mass[l];
  g.r_eff = Harmonic(g.r_own, g.r_other);
  g.m_own = mi;
  g.m_eff = Harmonic(mi, mj);
  g.roll_inertia =
      Harmonic(1.4f * mi * g.r_own * g.r_own, 1.4f * mj * g.r_other * g.r_other);
  g.k_old = 0.0f;
  return g;
}

/// The same contact as its second side sees it.
GROUSER_HD ContactGeometry OtherSide(const ContactGeometry& g, Vec3f w_other, float m_other) {
  ContactGeometry o = g;
  o.n = -1.0f * g.n;
  o.v_rel = -1.0f * g.v_rel;
  o.w_rel = -1.0f * g.w_rel;
  o.w_own = w_other;
  o.r_own = g.r_other;
  o.r_other = g.r_own;
  o.m_own = m_other;
  return o;
}

GROUSER_HD float Keep(bool keep, float value) { return keep ? value : 0.0f; }

template <class Law, bool kEnergy>
GROUSER_HD void BlockForces(const PairView& v, const Law& law, const Lanes& i, const Lanes& j,
                            const Gap& gap, float* history, LoadLanes& on_i,
                            LoadLanes& on_j, EnergyLanes& energy) {
  float* __restrict__ h[kMaxHistoryWords];
  const int words = law.Words();
  for (int w = 0; w < words; ++w) h[w] = history + w * L;
  const float dt = v.dt;
#pragma GCC ivdep
  for (int l = 0; l < L; ++l) {
    const ContactGeometry g = Geometry<Law::kRange>(i, j, gap, v.range, l);
    float word[Law::kMostWords], other[Law::kMostWords];
    for (int w = 0; w < words; ++w) other[w] = word[w] = h[w][l];
    const ContactResult r = law.Evaluate(i.kind[l], j.kind[l], g, word, dt);
    Vec3f moment = -1.0f * r.moment;
    float rolling = r.rolling;
    if (law.OwnSides()) {
      const ContactGeometry o = OtherSide(g, {j.wx[l], j.wy[l], j.wz[l]}, j.mass[l]);
      const ContactResult s = law.Evaluate(j.kind[l], i.kind[l], o, other, dt);
      moment = s.moment;
      rolling += s.rolling;
    }
    const bool touch = gap.touch[l] != 0 && (!Law::kRange || r.active);
    const Vec3f turn = Cross(g.n, r.force);
    const Vec3f on_first = r.moment - (g.r_own - 0.5f * g.overlap) * turn;
    const Vec3f on_second = moment - (g.r_other - 0.5f * g.overlap) * turn;
    for (int w = 0; w < words; ++w) h[w][l] = Keep(touch, word[w]);
    on_i.fx[l] = Keep(touch, r.force.x);
    on_i.fy[l] = Keep(touch, r.force.y);
    on_i.fz[l] = Keep(touch, r.force.z);
    on_i.deepest[l] = Keep(touch, g.overlap);
    on_i.tx[l] = Keep(touch, on_first.x);
    on_i.ty[l] = Keep(touch, on_first.y);
    on_i.tz[l] = Keep(touch, on_first.z);
    on_i.touching[l] = Keep(touch, 1.0f);
    on_j.fx[l] = -on_i.fx[l];
    on_j.fy[l] = -on_i.fy[l];
    on_j.fz[l] = -on_i.fz[l];
    on_j.deepest[l] = on_i.deepest[l];
    on_j.tx[l] = Keep(touch, on_second.x);
    on_j.ty[l] = Keep(touch, on_second.y);
    on_j.tz[l] = Keep(touch, on_second.z);
    on_j.touching[l] = on_i.touching[l];
    if (kEnergy) {
      energy.stored[l] += Keep(touch, r.stored);
      energy.normal[l] += Keep(touch, r.normal_damping);
      energy.tangent[l] += Keep(touch, r.tangent_damping);
      energy.slip[l] += Keep(touch, r.slip);
      energy.rolling[l] += Keep(touch, rolling);
      energy.plastic[l] += Keep(touch, r.plastic);
      // Breaking a neck or bridge costs in the step in which it goes.
      energy.cohesion[l] += Keep(gap.touch[l] != 0, r.cohesion);
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

/// A recipe, one material.
template <class R>
struct OneRecipe {
  static constexpr bool kRange = R::kHasRange;
  static constexpr int kMostWords = R::kWords;
  typename R::Params params;
  explicit OneRecipe(const PairView& v) : params(R::From(v.params[0])) {}
  static constexpr int Words() { return R::kWords; }
  static constexpr bool OwnSides() { return R::kOwnSides; }
  GROUSER_HD ContactResult Evaluate(std::int32_t, std::int32_t, const ContactGeometry& g,
                                    float* words, float dt) const {
    return R::Evaluate(params, g, words, dt);
  }
};

/// Any laws, any materials.
struct AnyLaws {
  static constexpr bool kRange = true;
  static constexpr int kMostWords = kMaxHistoryWords;
  const PairView& view;
  explicit AnyLaws(const PairView& v) : view(v) {}
  int Words() const { return view.layout.words; }
  bool OwnSides() const { return view.layout.own_sides; }
  GROUSER_HD ContactResult Evaluate(std::int32_t kind_i, std::int32_t kind_j,
                                    const ContactGeometry& g, float* words, float dt) const {
    const int i = kind_i & 0xffff, j = kind_j & 0xffff;
    return EvaluateGeneric(view.laws, view.layout, view.params[i * view.materials + j], g, words,
                           dt);
  }
};

template <class Law, bool kEnergy>
void Blocks(const PairView& view, std::int64_t from, std::int64_t to, EnergySums* total) {
  const Law law(view);
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
PairKernelFn Choose(int recipe, bool energy, RecipeList<R...>) {
  static constexpr PairKernelFn plain[] = {Blocks<OneRecipe<R>, false>...};
  static constexpr PairKernelFn counted[] = {Blocks<OneRecipe<R>, true>...};
  return energy ? counted[recipe] : plain[recipe];
}

}  // namespace
}  // namespace grouser::dem::GROUSER_ISA_NS
