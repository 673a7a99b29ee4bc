// The law of HardGround (hard_ground.h) by packs of GROUSER_LANES: included once per instruction
// set.
#include "surrogate/models/hard_ground_kernel.h"
#include "surrogate/models/number.h"

namespace grouser::surrogate::hard::GROUSER_ISA_NS {
namespace {

typedef double Pack __attribute__((vector_size(GROUSER_LANES * sizeof(double))));
using Truth = Mask<Pack>;

constexpr double kRollingBand = 0.02;  // |r w| over max(|r w|, V) below which sgn is smoothed

// A value and its derivatives by v_x, v_y and rim speed, over the load.
struct Term {
  Pack value, d_x, d_y, d_rim;
};

// How much of the friction is mobilised, over S, and how that changes.
struct Mobilised {
  Pack over_slide;        // g/S
  Pack by_slide, by_rim;  // its derivatives by S and by |r w|
  Pack by_friction;       // d(mu g)/d mu, over S
  Pack by_stiffness;      // C dg/dC, over S
  Pack rest;              // 1 - x, 0 where all slides
  Pack per_slide;         // 1/S, 0 at rest
  Pack per_rolling;       // 1/|r w|, 0 where all slides
};
GROUSER_INLINE Mobilised Mobilise(double stiffness, Pack slide, Pack rolling) {
  const Pack none = Pack{}, one = Set<Pack>(1);
  const Truth slides = stiffness * slide >= rolling;
  const Pack per_slide = Select<Pack>(slide > none, one / Max(slide, Set<Pack>(1e-300)), none);
  const Pack per_rolling = Select<Pack>(slides, none, one / Select<Pack>(slides, one, rolling));
  const Pack per = stiffness * per_rolling, x = per * slide, rest = 1.0 - x;
  const Pack h = per * (3.0 - 3.0 * x + x * x), steep = per * (2.0 * x - 3.0);
  return {Select<Pack>(slides, per_slide, h),
          Select<Pack>(slides, -per_slide * per_slide, steep * per),
          -(h + steep * x) * per_rolling,
          Select<Pack>(slides, per_slide, per * x * (3.0 - 2.0 * x)),
          3.0 * per * rest * rest,
          Select<Pack>(slides, none, rest),
          per_slide,
          per_rolling};
}

GROUSER_INLINE void Put(double* to, int i, Pack x) {
  if (to != nullptr) Store(to + i, x);
}

GROUSER_INLINE void Write(double* const (&to)[kParts], int i, const Term& t, Pack load, Pack sd) {
  const Pack value = load * t.value + 0.0;  // never -0
  Put(to[kValue], i, value);
  Put(to[kSdFit], i, load * sd);
  Put(to[kSdPatch], i, Pack{});
  Put(to[kLow], i, value - kTwoSided90 * (load * sd));
  Put(to[kHigh], i, value + kTwoSided90 * (load * sd));
  Put(to[kDvX], i, load * t.d_x);
  Put(to[kDvY], i, load * t.d_y);
  Put(to[kDRim], i, load * t.d_rim);
  Put(to[kDLoad], i, t.value);
}

// sgn of the rim speed, smoothed as u (3 - u^2)/2, u = r w/(band V).
GROUSER_INLINE Term Sign(Pack v_x, Pack v_y, Pack rim, Pack rolling) {
  const Pack none = Pack{}, one = Set<Pack>(1), hub2 = v_x * v_x + v_y * v_y;
  const Pack band = kRollingBand * Sqrt(hub2);
  const Truth smooth = rolling < band;
  const Pack per_band = Select<Pack>(smooth, one / Select<Pack>(smooth, band, one), none);
  const Pack u = rim * per_band, steep = 1.5 * (1.0 - u * u) * per_band;
  const Pack per = steep * u * (kRollingBand * kRollingBand) * per_band;  // steep u/hub2
  const Pack sharp = Select<Pack>(rim < none, -one, Select<Pack>(rim > none, one, none));
  return {Select<Pack>(smooth, u * (3.0 - u * u) * 0.5, sharp), -per * v_x, -per * v_y, steep};
}

GROUSER_INLINE void Answer(const Law& law, const Block& b, int i) {
  const Pack v_x = Load<Pack>(b.v_x + i), v_y = Load<Pack>(b.v_y + i), rim = Load<Pack>(b.rim + i);
  const Pack load = Load<Pack>(b.load + i);
  const Pack yaw = b.yaw != nullptr ? Load<Pack>(b.yaw + i) : Pack{};
  const double rho = law.scrub_radius, mu = law.friction, k = law.stiffness;
  const Pack s_x = v_x - rim, s_y = v_y, s_z = rho * yaw;
  const Pack slide = Sqrt<Pack>(s_x * s_x + s_y * s_y + s_z * s_z), rolling = Abs(rim);
  const Pack sense = Select<Pack>(rim < Pack{}, Set<Pack>(-1), Set<Pack>(1));
  const Mobilised m = Mobilise(k, slide, rolling);
  // mu dg/d(v_x, v_y, rim): by S along s/S, by |r w| besides.
  const Pack per = m.by_slide * m.per_slide;
  const Term g{mu * m.over_slide, mu * (per * s_x), mu * (per * s_y),
               mu * (m.by_rim * sense - per * s_x)};
  const Term f_x{-g.value * s_x, -(g.value + s_x * g.d_x), -s_x * g.d_y, g.value - s_x * g.d_rim};
  const Term f_y{-g.value * s_y, -s_y * g.d_x, -(g.value + s_y * g.d_y), -s_y * g.d_rim};
  const Pack turn = rho * s_z;
  Term m_z{-turn * g.value, -turn * g.d_x, -turn * g.d_y, -turn * g.d_rim};
  // Aligning, where not all slides; 1 - x = 1 - k S/|r w|.
  const Pack per_rim = sense * m.per_rolling, rest2 = m.rest * m.rest;
  const Pack scale = mu * law.half_length * k * per_rim, lever = scale * rest2 * m.rest;
  const Pack steep = -3.0 * scale * rest2 * s_y * k * m.per_rolling, along = steep * m.per_slide;
  m_z.value += lever * s_y;
  m_z.d_x += along * s_x;
  m_z.d_y += along * s_y + lever;
  m_z.d_rim -= along * s_x + steep * slide * per_rim + lever * s_y * per_rim;

  const Term sign = Sign(v_x, v_y, rim, rolling);
  const double r = law.radius, resist = law.resistance * r;
  const Term torque{r * f_x.value + resist * sign.value, r * f_x.d_x + resist * sign.d_x,
                    r * f_x.d_y + resist * sign.d_y, r * f_x.d_rim + resist * sign.d_rim};
  const Pack sd_mu = m.by_friction * law.friction_sd, sd_c = m.by_stiffness * law.grip_sd;
  const Pack sd = Sqrt<Pack>(sd_mu * sd_mu + sd_c * sd_c);
  const Pack sd_x = sd * Abs(s_x), sd_roll = law.resistance_sd * sign.value;
  Write(b.part[kFx], i, f_x, load, sd_x);
  Write(b.part[kFy], i, f_y, load, sd * Abs(s_y));
  Write(b.part[kTorque], i, torque, load, r * Sqrt<Pack>(sd_x * sd_x + sd_roll * sd_roll));
  Write(b.part[kMz], i, m_z, load, sd * rho * Abs(s_z));
  Write(b.part[kFz], i, Term{Set<Pack>(1), Pack{}, Pack{}, Pack{}}, load, Pack{});
  Write(b.part[kSinkage], i, Term{}, load, Pack{});
}

}  // namespace

void Evaluate(const Law& law, const Block& block) noexcept {
  for (int i = 0; i < block.count; i += GROUSER_LANES) Answer(law, block, i);
}

}  // namespace grouser::surrogate::hard::GROUSER_ISA_NS
