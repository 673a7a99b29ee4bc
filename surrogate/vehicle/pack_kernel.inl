// The kernels of pack.h by packs of GROUSER_LANES: included once per instruction set.
#include "surrogate/models/number.h"
#include "surrogate/vehicle/pack.h"

namespace grouser::vehicle::pack::GROUSER_ISA_NS {
namespace {

using surrogate::Abs, surrogate::Max, surrogate::Min, surrogate::Select, surrogate::Set;
using surrogate::Sqrt;
typedef double V __attribute__((vector_size(GROUSER_LANES * sizeof(double))));
using Truth = surrogate::Mask<V>;

constexpr double kInside = 1e-9;  // see Support
constexpr double kTwoSided90 = 1.6448536269514722;
constexpr double kLeastCosine = 0.02;  // between imbalance and what an unknown does to it
constexpr double kMostStep = 0.5;      // of the fastest speed, and radians of steering

GROUSER_INLINE V At(const PerLane& row, int g) { return surrogate::Load<V>(row + g); }
GROUSER_INLINE void Put(PerLane& row, int g, V v) { surrogate::Store(row + g, v); }
GROUSER_INLINE Truth At(const Truths& row, int g) {
  Truth t;
  __builtin_memcpy(&t, row + g, sizeof(t));
  return t;
}
GROUSER_INLINE void Put(Truths& row, int g, Truth t) { __builtin_memcpy(row + g, &t, sizeof(t)); }
GROUSER_INLINE void PutWhere(Truth where, PerLane& row, int g, V v) {
  Put(row, g, Select<V>(where, v, At(row, g)));
}

struct Twist {
  V v_x, v_y, yaw;
};
GROUSER_INLINE Twist TwistOf(const Unknowns& u, const Lanes& s, int g) {
  const bool given = u.v_x < 0;
  return {given ? At(s.v_x, g) : At(s.at[1], g), At(s.at[0], g),
          given ? At(s.yaw, g) : At(s.at[2], g)};
}

// What gravity and inertia ask for, and the loads where all wheels stay down.
GROUSER_INLINE void PlaceLoads(const Body& b, const Unknowns& u, const Twist& t, int g, Lanes* s) {
  const double m = b.mass, x = b.centre_x, y = b.centre_y, z = b.centre_z;
  const V yaw_up = At(s->yaw_up, g), load = At(s->load, g);
  const V f_x =
      m * (At(s->acceleration, g) - t.yaw * (t.v_y + t.yaw * x) - yaw_up * y + At(s->gravity_x, g));
  const V f_y = m * (t.yaw * (t.v_x - t.yaw * y) + yaw_up * x + At(s->gravity_y, g));
  Put(s->f_x, g, f_x);
  Put(s->f_y, g, f_y);
  Put(s->m_z, g, x * f_y - y * f_x + b.yaw_inertia * yaw_up);
  const V by_x = x * load - z * f_x + At(s->at[u.moment], g), by_y = y * load - z * f_y;
  const V dx = by_x / load - b.middle_x, dy = by_y / load - b.middle_y;
  V farthest = V{};
  for (int e = 0; e < b.edges; ++e) {
    const V out = b.edge_x[e] * dx + b.edge_y[e] * dy;
    farthest = Select<V>(farthest < out, out, farthest);
  }
  const V margin = 1.0 - farthest;
  Put(s->tip_margin, g, margin);
  const Truth stands = margin > V{};
  Truth rare = margin < kInside;
  for (int i = 0; i < b.wheels; ++i) {
    const Body::Wheel& w = b.wheel[i];
    Placed& p = s->placed;
    const V carried = w.load_by_load * load + w.load_by_x * by_x + w.load_by_y * by_y;
    rare |= carried < V{};
    Put(p.load[i], g, carried);
    Put(p.load_by_moment[i], g, Select<V>(stands, Set<V>(w.load_by_x), V{}));
    Put(p.load_by_v_y[i], g, Select<V>(stands, w.load_by_x * z * m * t.yaw, V{}));
    if (u.v_x < 0) continue;
    Put(p.load_by_v_x[i], g, Select<V>(stands, -w.load_by_y * z * m * t.yaw, V{}));
    Put(p.load_by_yaw[i], g,
        Select<V>(stands,
                  w.load_by_x * z * m * (t.v_y + 2 * t.yaw * x) -
                      w.load_by_y * z * m * (t.v_x - 2 * t.yaw * y),
                  V{}));
  }
  Put(s->rare, g, rare);
}

GROUSER_INLINE void PlaceWheel(const Body& b, const Unknowns& u, const Twist& t, int i, int g,
                               Lanes* s) {
  const Body::Wheel& w = b.wheel[i];
  Placed& p = s->placed;
  const V one = Set<V>(1);
  // What the steering asks of this wheel: direction and, over that of the drive, speed.
  V asked = one, asked_slope = V{}, cos = one, sin = V{}, steer_slope = V{};
  if (b.steered) {
    const V psi_cos = At(s->psi_cos, g), psi_sin = At(s->psi_sin, g);
    const V a = psi_cos - psi_sin * w.across, c = psi_sin * w.along;
    asked = a;
    asked_slope = -psi_sin - psi_cos * w.across;
    if (w.steered) {
      const V h = Max<V>(Sqrt<V>(a * a + c * c), Set<V>(1e-9));
      cos = a / h;
      sin = c / h;
      steer_slope = (a * psi_cos * w.along - c * asked_slope) / (h * h);
      asked_slope = (a * asked_slope + c * psi_cos * w.along) / h;
      asked = h;
    }
  }
  const V x = t.v_x - t.yaw * w.y, y = t.v_y + t.yaw * w.x;
  Put(p.v_x[i], g, w.steered ? cos * x + sin * y : x);
  Put(p.v_y[i], g, w.steered ? cos * y - sin * x : y);
  Put(p.yaw[i], g, t.yaw);
  Put(p.cos[i], g, cos);
  Put(p.sin[i], g, sin);
  Put(p.steer_slope[i], g, steer_slope);
  Put(p.rim_by_own[i], g, one);
  Put(p.rim_by_psi[i], g, V{});
  if (u.rim[i] >= 0) {
    Put(p.rim[i], g, At(s->at[u.rim[i]], g));
    return;
  }
  const int drive = u.drive[w.drive];
  const V speed = drive >= 0 ? At(s->at[drive], g) : At(s->rim_given[w.drive], g);
  Put(p.rim[i], g, w.follows ? speed * asked : speed);
  if (!w.follows) return;
  Put(p.rim_by_own[i], g, asked);
  Put(p.rim_by_psi[i], g, speed * asked_slope);
}

void Place(const Body& b, const Unknowns& u, int lanes, Lanes* s) noexcept {
  for (int g = 0; g < lanes; g += GROUSER_LANES) {
    const Twist t = TwistOf(u, *s, g);
    PlaceLoads(b, u, t, g, s);
    for (int i = 0; i < b.wheels; ++i) PlaceWheel(b, u, t, i, g, s);
  }
}

// Answers of a wheel: [output][part].
struct Answers {
  V f[4][5];
};

// Less gross traction (torque over radius: of driving wheels and of braking ones) and lateral
// force, more torque; sds are in proportion to the load. Of a force f, f s/hypot(f, s) is lost:
// smooth, and what is left keeps its sign and grows with f.
GROUSER_INLINE void Worsen(const Body::Wheel& w, const Felt& felt, V sds, V load, V rim, int i,
                           int g, Answers* to) {
  V(&f)[4][5] = to->f;
  const Truth worse = (load > V{}) & (sds != V{});
  const V per_sd = sds / kTwoSided90, one = Set<V>(1);
  const V pull = (At(felt.high[0][i], g) - f[0][0]) * per_sd;
  const V side = (At(felt.high[1][i], g) - f[1][0]) * per_sd;
  const V torque = (At(felt.high[2][i], g) - f[2][0]) * per_sd * Select<V>(rim < V{}, -one, one);
  const V traction = f[2][0] * w.per_radius, per_load = 1.0 / load;
  const V size = Sqrt<V>(traction * traction + pull * pull);
  const Truth pulls = worse & (size > V{});
  const V a = pull / size, c = traction / size, share = a * a * a * w.per_radius;
  f[0][0] = Select<V>(pulls, f[0][0] - traction * a, f[0][0]);
  for (int k = 1; k < 5; ++k) f[0][k] = Select<V>(pulls, f[0][k] - share * f[2][k], f[0][k]);
  f[0][4] = Select<V>(pulls, f[0][4] - c * c * c * pull * per_load, f[0][4]);
  f[2][0] = Select<V>(worse, f[2][0] + torque, f[2][0]);
  f[2][4] = Select<V>(worse, f[2][4] + torque * per_load, f[2][4]);
  const V size_y = Sqrt<V>(f[1][0] * f[1][0] + side * side);
  const V left = Select<V>(worse & (size_y > V{}), 1.0 - side / size_y, one);
  for (int k = 0; k < 5; ++k) f[1][k] = f[1][k] * left;
}

// Adds, column by column, what the unknowns do to an answer: the chain rule over the wheel's
// state. by: the answer and its derivatives by v_x, v_y, rim speed and load.
struct Chain {
  const Body::Wheel& w;
  const Unknowns& u;
  V cos, sin, v_x, v_y, steer_slope, rim_by_psi, rim_by_own;
  V load_by_v_x, load_by_v_y, load_by_yaw, load_by_moment;
  int own;

  GROUSER_INLINE Chain(const Body& b, const Unknowns& unknowns, const Placed& p, int i, int g)
      : w(b.wheel[i]),
        u(unknowns),
        cos(At(p.cos[i], g)),
        sin(At(p.sin[i], g)),
        v_x(At(p.v_x[i], g)),
        v_y(At(p.v_y[i], g)),
        steer_slope(At(p.steer_slope[i], g)),
        rim_by_psi(At(p.rim_by_psi[i], g)),
        rim_by_own(At(p.rim_by_own[i], g)),
        load_by_v_x(At(p.load_by_v_x[i], g)),
        load_by_v_y(At(p.load_by_v_y[i], g)),
        load_by_yaw(At(p.load_by_yaw[i], g)),
        load_by_moment(At(p.load_by_moment[i], g)),
        own(u.rim[i] >= 0 ? u.rim[i] : u.drive[w.drive]) {}

  // stride: between the columns.
  GROUSER_INLINE void Add(const V (&by)[5], V* column, int stride) const {
    const auto add = [&](int k, V x) { column[k * stride] += x; };
    add(0, (w.steered ? sin * by[1] + cos * by[2] : by[2]) + load_by_v_y * by[4]);
    if (u.v_x >= 0) {
      add(1, cos * by[1] - sin * by[2] + load_by_v_x * by[4]);
      add(2,
          (sin * w.x - cos * w.y) * by[1] + (cos * w.x + sin * w.y) * by[2] + load_by_yaw * by[4]);
    } else if (u.psi >= 0 && (w.steered || w.follows)) {
      add(u.psi, steer_slope * (v_y * by[1] - v_x * by[2]) + rim_by_psi * by[3]);
    }
    if (own >= 0) add(own, w.follows ? rim_by_own * by[3] : by[3]);
    add(u.moment, load_by_moment * by[4]);
  }
};

// Sums of the first four rows over the wheels, and their columns.
struct Sums {
  V row[4], column[kUnknowns][4];
};

// A wheel's part of the first four rows.
GROUSER_INLINE void AddWheel(const Chain& c, const Answers& a, V arm, Sums* sums) {
  const Body::Wheel& w = c.w;
  V by[4][5];
  const V turn_x = c.sin * w.x - c.cos * w.y, turn_y = c.cos * w.x + c.sin * w.y;
  const V lever = -c.cos * arm;
  for (int k = 0; k < 5; ++k) {
    const V f_x = a.f[0][k], f_y = a.f[1][k], torque = a.f[2][k], m_z = a.f[3][k];
    by[0][k] = w.steered ? f_x * c.cos + f_y * -c.sin : f_x;
    by[1][k] = w.steered ? f_x * c.sin + f_y * c.cos : f_y;
    by[2][k] = f_x * turn_x + f_y * turn_y + m_z;
    by[3][k] = w.steered ? f_x * lever + torque * c.cos : f_x * lever + torque;
  }
  for (int r = 0; r < 4; ++r) {
    sums->row[r] += by[r][0];
    c.Add(by[r], &sums->column[0][r], 4);
  }
  if (c.u.psi < 0 || !w.steered) return;
  const V x = -by[1][0], y = by[0][0];  // the forces turn with the wheel
  V(&psi)[4] = sums->column[c.u.psi];
  psi[0] += c.steer_slope * x;
  psi[1] += c.steer_slope * y;
  psi[2] += c.steer_slope * (w.x * y - w.y * x);
  psi[3] += c.steer_slope * (c.sin * (arm * a.f[0][0] - a.f[2][0]));
}

// What gravity and inertia ask for changes with the twist.
GROUSER_INLINE void AddInertia(const Body& b, const Unknowns& u, const Lanes& s, int g,
                               Sums* sums) {
  const double m = b.mass, xg = b.centre_x, yg = b.centre_y;
  const V yaw = u.v_x >= 0 ? At(s.at[2], g) : At(s.yaw, g);
  const auto add = [&](int k, V by_f_x, V by_f_y) {
    sums->column[k][0] -= by_f_x;
    sums->column[k][1] -= by_f_y;
    sums->column[k][2] -= xg * by_f_y - yg * by_f_x;
  };
  add(0, -m * yaw, V{});
  sums->column[u.moment][3] += 1.0;
  if (u.v_x < 0) return;
  add(1, V{}, m * yaw);
  add(2, -m * (At(s.at[0], g) + 2 * yaw * xg), m * (At(s.at[1], g) - 2 * yaw * yg));
}

// The row of a wheel with a speed of its own: without a drive the torque is 0; behind a
// differential all torques are equal and the drive has their mean speed.
GROUSER_INLINE void FreeRow(const Body& b, const Unknowns& u, const Answers* answers, int i, int g,
                            Lanes* s) {
  const Body::Wheel& w = b.wheel[i];
  const int row = u.rim[i];
  V residual = V{}, column[kUnknowns];
  for (int k = 0; k < u.size; ++k) column[k] = V{};
  if (w.drive < 0 || w.first != i) {
    const auto add = [&](int wheel, double factor) {
      V by[5];
      for (int k = 0; k < 5; ++k) by[k] = factor * answers[wheel].f[2][k];
      residual += by[0];
      Chain(b, u, s->placed, wheel, g).Add(by, column, 1);
    };
    add(i, b.per[3]);
    if (w.drive >= 0) add(w.first, -b.per[3]);
    for (int k = 0; k < u.size; ++k) column[k] *= At(s->unit[k], g);
  } else {
    V sum = V{};
    double count = 0;
    for (int k = 0; k < b.wheels; ++k) {
      if (b.wheel[k].drive != w.drive) continue;
      sum += At(s->placed.rim[k], g);
      ++count;
    }
    const V speed = At(s->speed, g);
    const int drive = u.drive[w.drive];
    const V asked = drive >= 0 ? At(s->at[drive], g) : At(s->rim_given[w.drive], g);
    residual = (sum / count - asked) / speed;
    for (int k = 0; k < b.wheels; ++k) {
      if (b.wheel[k].drive == w.drive)
        column[u.rim[k]] = At(s->unit[u.rim[k]], g) / (count * speed);
    }
    if (drive >= 0) column[drive] = -At(s->unit[drive], g) / speed;
  }
  Put(s->tried[row], g, residual);
  for (int k = 0; k < u.size; ++k) Put(s->fresh[row][k], g, column[k]);
}

GROUSER_INLINE void WeighGroup(const Body& b, const Unknowns& u, int g, Lanes* s) {
  Answers answers[kWheels];
  Sums sums{{-At(s->f_x, g), -At(s->f_y, g), -At(s->m_z, g), At(s->at[u.moment], g)}, {}};
  const V sds = At(s->sds, g);
  for (int i = 0; i < b.wheels; ++i) {
    Felt& felt = s->felt;
    const Placed& p = s->placed;
    Answers& a = answers[i];
    for (int o = 0; o < 4; ++o) {
      for (int k = 0; k < 5; ++k) a.f[o][k] = At(felt.part[o][k][i], g);
    }
    Worsen(b.wheel[i], felt, sds, At(p.load[i], g), At(p.rim[i], g), i, g, &a);
    for (int o = 0; o < 4; ++o) Put(felt.part[o][0][i], g, a.f[o][0]);  // what a solution tells
    AddWheel(Chain(b, u, p, i, g), a, b.wheel[i].radius - At(felt.sinkage[i], g), &sums);
  }
  AddInertia(b, u, *s, g, &sums);
  for (int r = 0; r < 4; ++r) {
    Put(s->tried[r], g, sums.row[r] * b.per[r]);
    for (int k = 0; k < u.size; ++k) {
      Put(s->fresh[r][k], g, sums.column[k][r] * b.per[r] * At(s->unit[k], g));
    }
  }
  for (int i = 0; i < b.wheels; ++i) {
    if (u.rim[i] >= 0) FreeRow(b, u, answers, i, g, s);
  }
  V merit = V{}, largest = V{};
  for (int k = 0; k < u.size; ++k) {
    const V r = At(s->tried[k], g), size = Abs(r);
    merit += r * r;
    largest = Select<V>(size <= largest, largest, size);
  }
  Put(s->merit, g, merit);
  Put(s->largest, g, largest);
}

void Weigh(const Body& b, const Unknowns& u, int lanes, Lanes* s) noexcept {
  for (int g = 0; g < lanes; g += GROUSER_LANES) WeighGroup(b, u, g, s);
}

// Models give no gradients of their intervals, on which worse ground and draws rest: what these add
// is taken from the steps (Broyden), against the mean of the gradients at both ends of a step.
GROUSER_INLINE void LineariseGroup(const Unknowns& u, int g, Lanes* s) {
  const int n = u.size;
  const Truth going = At(s->going, g), worse = At(s->learning, g);
  const V back = -At(s->share, g);
  V step[kUnknowns], moved = V{};
  for (int k = 0; k < n; ++k) {
    step[k] = At(s->step[k], g) * back;
    moved += step[k] * step[k];
  }
  const Truth learns = going & worse & ~At(s->begins, g) & (moved > V{});
  V along[kUnknowns], size[kUnknowns];
  for (int k = 0; k < n; ++k) {
    along[k] = size[k] = V{};
    PutWhere(going, s->last[k], g, At(s->at[k], g));
  }
  for (int i = 0; i < n; ++i) {
    const V tried = At(s->tried[i], g);
    V more = tried - At(s->residual[i], g);
    for (int k = 0; k < n; ++k) {
      more -=
          (At(s->missing[i][k], g) + (At(s->gradients[i][k], g) + At(s->fresh[i][k], g)) / 2.0) *
          step[k];
    }
    PutWhere(going, s->residual[i], g, tried);
    for (int k = 0; k < n; ++k) {
      const V fresh = At(s->fresh[i][k], g), known = At(s->missing[i][k], g);
      const V missing = Select<V>(learns, known + more * step[k] / moved, known);
      const V entry = Select<V>(worse, fresh + missing, fresh);
      Put(s->missing[i][k], g, missing);
      PutWhere(going, s->gradients[i][k], g, fresh);
      PutWhere(going, s->jacobian[i][k], g, entry);
      along[k] += entry * tried;
      size[k] += entry * entry;
    }
  }
  const V merit = At(s->merit, g);
  Truth least = going;
  for (int k = 0; k < n; ++k) {
    least &= ~(along[k] * along[k] > kLeastCosine * kLeastCosine * size[k] * merit);
  }
  Put(s->least, g, least);
}

void Linearise(const Body&, const Unknowns& u, int lanes, Lanes* s) noexcept {
  for (int g = 0; g < lanes; g += GROUSER_LANES) {
    if (surrogate::Any<V>(At(s->going, g))) LineariseGroup(u, g, s);
  }
}

// As Eliminate of linear.h, each lane with its own pivots.
template <int kSize>
GROUSER_INLINE void SolveGroup(int g, Lanes* s) {
  V a[kSize][kSize + 1], largest = V{};
  for (int i = 0; i < kSize; ++i) {
    a[i][kSize] = At(s->residual[i], g);
    for (int k = 0; k < kSize; ++k) {
      a[i][k] = At(s->jacobian[i][k], g);
      largest = Max<V>(Abs(a[i][k]), largest);
    }
  }
  Truth solved = At(s->solving, g);
  for (int c = 0; c < kSize; ++c) {
    V most = Abs(a[c][c]), pivot = Set<V>(c);
    for (int i = c + 1; i < kSize; ++i) {
      const V size = Abs(a[i][c]);
      pivot = Select<V>(size > most, Set<V>(i), pivot);
      most = Select<V>(size > most, size, most);
    }
    solved &= most > 1e-10 * largest;
    for (int i = c + 1; i < kSize; ++i) {
      const Truth swap = pivot == Set<V>(i);
      if (!surrogate::Any<V>(swap)) continue;
      for (int k = c; k <= kSize; ++k) {
        const V up = a[c][k], down = a[i][k];
        a[c][k] = Select<V>(swap, down, up);
        a[i][k] = Select<V>(swap, up, down);
      }
    }
    const V inverse = 1.0 / a[c][c];
    for (int i = c + 1; i < kSize; ++i) {
      const V f = a[i][c] * inverse;
      for (int k = c + 1; k <= kSize; ++k) a[i][k] -= f * a[c][k];
    }
  }
  V x[kSize];
  for (int c = kSize; c-- > 0;) {
    V sum = a[c][kSize];
    for (int k = c + 1; k < kSize; ++k) sum -= a[c][k] * x[k];
    x[c] = sum / a[c][c];
  }
  for (int c = 0; c < kSize; ++c) PutWhere(solved, s->step[c], g, x[c]);
  Put(s->solved, g, solved);
}

void Solve(const Body&, const Unknowns& u, int lanes, Lanes* s) noexcept {
  for (int g = 0; g < lanes; g += GROUSER_LANES) {
    if (!surrogate::Any<V>(At(s->solving, g))) continue;
    if (u.size == 4) {
      SolveGroup<4>(g, s);
    } else {
      SolveGroup<8>(g, s);
    }
  }
}

// Speeds change by a part of the fastest one, angles by a part of a radian; each unknown by itself,
// as one that has hardly any effect (rims of wheels without load) takes long steps.
void Move(const Body& b, const Unknowns& u, int lanes, Lanes* s) noexcept {
  for (int g = 0; g < lanes; g += GROUSER_LANES) {
    const Truth moving = At(s->moving, g), stepping = At(s->stepping, g);
    const V speed = At(s->speed, g), share = At(s->share, g);
    V fastest = speed;
    for (int i = 0; i < b.wheels; ++i) {
      const V rim = Abs(At(s->placed.rim[i], g));
      fastest = Select<V>(fastest < rim, rim, fastest);
    }
    for (int k = 0; k < u.size; ++k) {
      V step = At(s->step[k], g);
      if (k != u.moment) {
        const V limit = k == u.psi ? Set<V>(kMostStep) : kMostStep * (fastest / speed);
        const V bounded = Select<V>(step < -limit, -limit, Select<V>(limit < step, limit, step));
        step = Select<V>(stepping, bounded, step);
        Put(s->step[k], g, step);
      }
      PutWhere(moving, s->at[k], g, At(s->last[k], g) - share * step * At(s->unit[k], g));
    }
  }
}

}  // namespace

extern const Kernel kKernel;
const Kernel kKernel = {Place, Weigh, Linearise, Solve, Move};

}  // namespace grouser::vehicle::pack::GROUSER_ISA_NS
