// The body of the pair kernel, compiled once per instruction set: GROUSER_ISA_NS
// names the set. Instantiates nothing from the standard library, so that no
// code of a higher set can leak into the rest of the program. What evaluates a
// contact is a template argument: a recipe of the menu, or the generic path.

namespace grouser::dem::GROUSER_ISA_NS {
namespace {

constexpr int L = kLanes;

/// One row of lanes as structure of arrays.
struct alignas(64) Lanes {
  std::int32_t x[L], y[L], z[L], kind[L];
  float radius[L], vx[L], vy[L], vz[L], mass[L], wx[L], wy[L], wz[L];
};

struct alignas(64) Sums {
  float fx[L], fy[L], fz[L], tx[L], ty[L], tz[L], touching[L], deepest[L];
};

struct alignas(64) Gap {
  float dx[L], dy[L], dz[L], d2[L], reach[L];
  std::int32_t touch[L];
};

struct alignas(64) EnergyLanes {
  float stored[L], normal[L], tangent[L], slip[L], rolling[L], plastic[L], cohesion[L];
};

GROUSER_HD void LoadPlaces(const Grain* g, const std::int32_t* j, Lanes& out) {
  for (int l = 0; l < L; ++l) {
    const Grain& p = g[j[l]];
    out.x[l] = p.x;
    out.y[l] = p.y;
    out.z[l] = p.z;
    out.radius[l] = p.radius;
  }
}

GROUSER_HD void LoadMotion(const Grain* g, const std::int32_t* j, Lanes& out) {
  for (int l = 0; l < L; ++l) {
    const Grain& p = g[j[l]];
    out.vx[l] = p.vx;
    out.vy[l] = p.vy;
    out.vz[l] = p.vz;
    out.mass[l] = p.mass;
    out.wx[l] = p.wx;
    out.wy[l] = p.wy;
    out.wz[l] = p.wz;
    out.kind[l] = p.kind;
  }
}

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

/// One contact as its first side sees it; a lane that does not touch gets a
/// harmless geometry and is masked afterwards.
template <bool kRange>
GROUSER_HD ContactGeometry Geometry(const Lanes& i, const Lanes& j, const Gap& gap, float range,
                                    int l, float* lever) {
  const bool touch = gap.touch[l] != 0;
  const float dist = Sqrt(touch ? gap.d2[l] : 1.0f);
  const float inv = 1.0f / dist;
  ContactGeometry g;
  g.n = {gap.dx[l] * inv, gap.dy[l] * inv, gap.dz[l] * inv};
  g.overlap = touch ? gap.reach[l] - dist : 1e-9f;
  if (!kRange || range == 0.0f) g.overlap = Max(g.overlap, 1e-12f);
  const float ri = Max(i.radius[l], 1e-9f), rj = Max(j.radius[l], 1e-9f);
  const float mi = Max(i.mass[l], 1e-30f), mj = Max(j.mass[l], 1e-30f);
  const float li = ri - 0.5f * g.overlap, lj = rj - 0.5f * g.overlap;
  const Vec3f wi = {i.wx[l], i.wy[l], i.wz[l]}, wj = {j.wx[l], j.wy[l], j.wz[l]};
  const Vec3f dv = {i.vx[l] - j.vx[l], i.vy[l] - j.vy[l], i.vz[l] - j.vz[l]};
  g.v_rel = dv - Cross(li * wi + lj * wj, g.n);
  g.w_rel = wi - wj;
  g.w_own = wi;
  g.r_own = ri;
  g.r_other = rj;
  g.r_eff = ri * rj / (ri + rj);
  g.m_own = mi;
  g.m_eff = mi * (mj / (mi + mj));
  const float ii = 1.4f * mi * ri * ri, ij = 1.4f * mj * rj * rj;
  g.roll_inertia = ii * (ij / (ii + ij));
  g.k_old = 0.0f;
  *lever = li;
  return g;
}

GROUSER_HD float Keep(bool keep, float value) { return keep ? value : 0.0f; }

template <class Law, bool kEnergy>
GROUSER_HD void RowForces(const PairView& v, const Law& law, const Lanes& i, const Lanes& j,
                          const Gap& gap, std::int64_t slot, Sums& sum, EnergyLanes& energy) {
  float* __restrict__ h[kMaxHistoryWords];
  const int words = law.Words();
  for (int w = 0; w < words; ++w) h[w] = v.history[w] + slot;
  const float dt = v.dt;
#pragma GCC ivdep
  for (int l = 0; l < L; ++l) {
    float lever;
    const ContactGeometry g = Geometry<Law::kRange>(i, j, gap, v.range, l, &lever);
    float word[Law::kMostWords];
    for (int w = 0; w < words; ++w) word[w] = h[w][l];
    const ContactResult r = law.Evaluate(i.kind[l], j.kind[l], g, word, dt);
    const bool touch = gap.touch[l] != 0 && (!Law::kRange || r.active);
    const Vec3f torque = r.moment - lever * Cross(g.n, r.force);
    for (int w = 0; w < words; ++w) h[w][l] = Keep(touch, word[w]);
    sum.fx[l] += Keep(touch, r.force.x);
    sum.fy[l] += Keep(touch, r.force.y);
    sum.fz[l] += Keep(touch, r.force.z);
    sum.tx[l] += Keep(touch, torque.x);
    sum.ty[l] += Keep(touch, torque.y);
    sum.tz[l] += Keep(touch, torque.z);
    sum.touching[l] += Keep(touch, 1.0f);
    sum.deepest[l] = Max(sum.deepest[l], Keep(touch, g.overlap));
    if (kEnergy) {
      energy.stored[l] += Keep(touch, r.stored);
      energy.normal[l] += Keep(touch, r.normal_damping);
      energy.tangent[l] += Keep(touch, r.tangent_damping);
      energy.slip[l] += Keep(touch, r.slip);
      energy.rolling[l] += Keep(touch, r.rolling);
      energy.plastic[l] += Keep(touch, r.plastic);
      // Breaking a neck or bridge costs in the step in which it goes.
      energy.cohesion[l] += Keep(gap.touch[l] != 0, r.cohesion);
    }
  }
}

GROUSER_HD void ClearRow(const PairView& v, int words, std::int64_t slot) {
  for (int w = 0; w < words; ++w) {
    for (int l = 0; l < L; ++l) v.history[w][slot + l] = 0.0f;
  }
}

/// Index body of the kernel: all contacts of the kLanes grains of one tile.
template <class Law, bool kEnergy>
void TileForces(const PairView& v, const Law& law, int tile, EnergySums* total) {
  Lanes mine, theirs;
  Gap gap;
  Sums sum = {};
  EnergyLanes energy = {};
  std::int32_t self[L];
  for (int l = 0; l < L; ++l) self[l] = tile * L + l;
  LoadPlaces(v.grains, self, mine);
  LoadMotion(v.grains, self, mine);
  for (std::int64_t slot = v.first_slot[tile]; slot < v.first_slot[tile + 1]; slot += L) {
    LoadPlaces(v.grains, v.partner + slot, theirs);
    const bool any = Distances<Law::kRange>(mine, theirs, v.quantum, v.range, gap);
    std::uint8_t& touched = v.row_touches[slot / L];
    if (any) {
      LoadMotion(v.grains, v.partner + slot, theirs);
      RowForces<Law, kEnergy>(v, law, mine, theirs, gap, slot, sum, energy);
    } else if (touched) {
      ClearRow(v, law.Words(), slot);
    }
    touched = any ? 1 : 0;
  }
  for (int l = 0; l < L; ++l) {
    v.loads[tile * L + l] = {sum.fx[l], sum.fy[l], sum.fz[l], sum.deepest[l],
                             sum.tx[l], sum.ty[l], sum.tz[l], sum.touching[l]};
  }
  if (kEnergy) {
    for (int l = 0; l < L; ++l) {
      total->stored += 0.5 * energy.stored[l];
      total->normal_damping += 0.5 * energy.normal[l];
      total->tangent_damping += 0.5 * energy.tangent[l];
      total->slip += 0.5 * energy.slip[l];
      total->rolling += 0.5 * energy.rolling[l];
      total->plastic += 0.5 * energy.plastic[l];
      total->cohesion += 0.5 * energy.cohesion[l];
    }
  }
}

/// A recipe, one material.
template <class R>
struct OneRecipe {
  static constexpr bool kRange = R::kHasRange;
  static constexpr int kMostWords = R::kWords;
  typename R::Params params;
  explicit OneRecipe(const PairView& v) : params(R::From(v.params[0])) {}
  static constexpr int Words() { return R::kWords; }
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
  GROUSER_HD ContactResult Evaluate(std::int32_t kind_i, std::int32_t kind_j,
                                    const ContactGeometry& g, float* words, float dt) const {
    const int i = kind_i & 0xffff, j = kind_j & 0xffff;
    return EvaluateGeneric(view.laws, view.layout, view.params[i * view.materials + j], g, words,
                           dt);
  }
};

template <class Law, bool kEnergy>
void Tiles(const PairView& view, int first, int last, EnergySums* energy) {
  const Law law(view);
  for (int t = first; t < last; ++t) TileForces<Law, kEnergy>(view, law, t, energy);
}

template <class... R>
PairKernelFn Choose(int recipe, bool energy, RecipeList<R...>) {
  static constexpr PairKernelFn plain[] = {Tiles<OneRecipe<R>, false>...};
  static constexpr PairKernelFn counted[] = {Tiles<OneRecipe<R>, true>...};
  return energy ? counted[recipe] : plain[recipe];
}

}  // namespace
}  // namespace grouser::dem::GROUSER_ISA_NS
