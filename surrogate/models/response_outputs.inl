// Part of response_kernel.inl: from channels to outputs, uncertainty, flags,
// gradients and echoes of a block.

// Where an output that nobody wants goes.
struct Unwanted {
  double part[kParts][kBlock];
};

GROUSER_INLINE double* Or(double* wanted, double* unwanted) { return wanted ? wanted : unwanted; }

GROUSER_INLINE constexpr bool OddX(int output) { return kOutputFields[output].parity_x < 0; }
GROUSER_INLINE constexpr bool OddY(int output) { return kOutputFields[output].parity_y < 0; }
constexpr int kDistanceChannel = kOutputs;

// kClamped for a negative sinkage, kExtrapolated far from every run and where
// no steady run exists; the squared hull distance.
GROUSER_INLINE void FlagStates(const Constants& c, Block* b, Scratch* s, int n) {
  std::uint32_t* out = b->flags;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float d = s->channel[0][kDistanceChannel][i];
    const float distance = (d > 0 ? d : 0.0f) + s->excess[i];
    const float sinkage = s->channel[0][kSinkage][i];
    s->distance2[i] = distance * distance;
    out[i] = c.flags | static_cast<std::uint32_t>(int(s->flags[i])) |
             (sinkage < 0 ? std::uint32_t{kClamped} : 0u) |
             ((distance > c.far) | (sinkage > c.overload) ? std::uint32_t{kExtrapolated} : 0u);
  }
}

// e^x for x <= 0, held at -8: to 1e-7 of 1.
GROUSER_INLINE float ExpOfLoss(float x) {
  const float y = (x > -8 ? x : -8.0f) * (1.0f / 16);
  float e = 1 + y * (1.0f / 8);
  for (int k = 7; k > 0; --k) e = 1 + y * e / static_cast<float>(k);
  e *= e;
  e *= e;
  e *= e;
  return e * e;
}

// What the soil carries where that is less than the load: kNoEquilibrium, kClamped,
// f_z and its slopes.
template <bool kGradients>
GROUSER_INLINE void Limit(Block* b, Scratch* s, int n) {
  for (int i = 0; i < n; ++i) {
    const float margin = s->channel[0][kMarginChannel][i];
    if (!(margin < 0)) continue;
    b->flags[i] |= kNoEquilibrium | kClamped;
    const float carried = ExpOfLoss(margin), f_z = s->channel[0][kFz][i] * carried;
    s->channel[0][kFz][i] = f_z;
    for (int k = 1; k < (kGradients ? 5 : 1); ++k) {
      s->channel[k][kFz][i] =
          s->channel[k][kFz][i] * carried + f_z * s->channel[k][kMarginChannel][i];
    }
  }
}

template <int kOutput>
GROUSER_INLINE void WriteOutput(const Constants& c, const Block& b, const Scratch& s,
                                Unwanted* unwanted, int n) {
  constexpr bool kLength = kOutput == kSinkage;
  double* const* part = b.part[kOutput];
  double* __restrict value = Or(part[kValue], unwanted->part[kValue]);
  double* __restrict sd_fit = Or(part[kSdFit], unwanted->part[kSdFit]);
  double* __restrict sd_patch = Or(part[kSdPatch], unwanted->part[kSdPatch]);
  double* __restrict low = Or(part[kLow], unwanted->part[kLow]);
  double* __restrict high = Or(part[kHigh], unwanted->part[kHigh]);
  const float* channel = s.channel[0][kOutput];
  const float inside2 = c.inside2[kOutput], growth2 = c.growth2[kOutput];
  const float patch = c.patch[kOutput], patch2 = c.patch2[kOutput], factor = c.factor[kOutput];
  const float bulldozing = c.bulldozing[kOutput];
  const double radius = c.radius, inverse_middle = c.inverse_middle_load;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const double scale = OutputScale(kOutput, s.load[i], radius);
    const float grown = 1.0f + bulldozing * s.bulldozing[i];
    const double ratio = (kLength ? 1.0 : s.load[i] * inverse_middle) * static_cast<double>(grown);
    float x = channel[i];
    if (kLength) x = x > 0 ? x : 0.0f;
    if (OddX(kOutput)) x = x * s.sign_x[i];
    if (OddY(kOutput)) x = x * s.sign_y[i];
    const double v = static_cast<double>(x + 0.0f) * scale;  // + 0: never -0
    const float fit2 = inside2 + growth2 * s.distance2[i];
    const double half = static_cast<double>(factor * __builtin_sqrtf(fit2 + patch2)) * ratio;
    value[i] = v;
    sd_fit[i] = static_cast<double>(__builtin_sqrtf(fit2)) * ratio;
    sd_patch[i] = static_cast<double>(patch) * ratio;
    low[i] = v - half;
    high[i] = v + half;
  }
}

// Chain rule through chart, mirrors and scaling. With the canonical state
// (p, y, r), rho = hypot(p, r) and R^2 = rho^2 + y^2:
//   d direction = (p dr - r dp)/rho^2,
//   d lateral   = (rho dy - y (p dp + r dr)/rho)/R^2;
// the table is homogeneous of degree 0, so that 1/M is all that M adds. On a speed
// axis du/dM is added, where M is V: M dM = v_x dv_x + v_y dv_y, else r w d(r w).
template <int kOutput>
GROUSER_INLINE void WriteGradients(const Constants& c, const Block& b, const Scratch& s,
                                   Unwanted* unwanted, int n) {
  constexpr bool kLength = kOutput == kSinkage;
  double* const* part = b.part[kOutput];
  double* __restrict d_x = Or(part[kDvX], unwanted->part[kDvX]);
  double* __restrict d_y = Or(part[kDvY], unwanted->part[kDvY]);
  double* __restrict d_rim = Or(part[kDRim], unwanted->part[kDRim]);
  double* __restrict d_load = Or(part[kDLoad], unwanted->part[kDLoad]);
  const float per_direction = static_cast<float>(c.direction) / 3.14159265f;
  const float per_lateral = static_cast<float>(c.lateral) / 1.57079633f;
  const double radius = c.radius;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float p = s.forward[i], y = s.lateral[i], r = s.rim[i], rho = s.plane[i];
    const float inverse_rho = 1.0f / (rho > 1e-6f ? rho : 1e-6f);
    const float inverse_r2 = 1.0f / (rho * rho + y * y);
    const float value = s.channel[0][kOutput][i];
    const bool held = kLength && value < 0;  // clamped to 0
    const float turn = s.channel[1][kOutput][i] * per_direction * inverse_rho * inverse_rho;
    const float tilt = s.channel[2][kOutput][i] * per_lateral * inverse_r2;
    const float along = tilt * y * inverse_rho;
    const float by_load = s.channel[3][kOutput][i] * c.load_per_log;
    const float sx = s.mirror[i], sy = s.sign_y[i];
    const float sign_plane = (OddX(kOutput) ? 1.0f : sx) * (OddY(kOutput) ? sy : 1.0f);
    const float sign_side = (OddX(kOutput) ? sx : 1.0f) * (OddY(kOutput) ? 1.0f : sy);
    const float sign = (OddX(kOutput) ? s.sign_x[i] : 1.0f) * (OddY(kOutput) ? sy : 1.0f);
    const double scale = OutputScale(kOutput, s.load[i], radius);
    const double rate = held ? 0.0 : scale * s.inverse_speed[i];
    const double lever = kLength || IsMoment(kOutput) ? radius : 1.0;
    const double inverse_load = kLength ? 1.0 / s.load[i] : 1.0;
    const float by_speed = s.channel[4][kOutput][i] * s.steepness[i];
    const float by_hub = by_speed * s.hub_first[i], by_rim = by_speed - by_hub;
    const double faster = held ? 0.0 : scale;
    d_x[i] = static_cast<double>(sign_plane * (-turn * r - along * p)) * rate +
             static_cast<double>(sign_plane * (by_hub * p)) * faster;
    d_rim[i] = static_cast<double>(sign_plane * (turn * p - along * r)) * rate +
               static_cast<double>(sign_plane * (by_rim * r)) * faster;
    d_y[i] = static_cast<double>(sign_side * (tilt * rho)) * rate +
             static_cast<double>(sign_side * (by_hub * y)) * faster;
    const float with_load = kLength ? by_load : value + by_load;
    d_load[i] = held ? 0.0 : static_cast<double>(sign * with_load) * lever * inverse_load;
  }
}

// Near the chart's pole the slopes by v_x and rim are quotients of small numbers.
GROUSER_INLINE void MarkPole(Block* b, const Scratch& s, int n) {
  for (int i = 0; i < n; ++i) b->special[i] |= s.plane[i] < 1e-3f * s.lateral[i] ? kPole : 0u;
}

// atan2(a, b) for a, b >= 0 (Cephes' atan): a few ulp.
GROUSER_INLINE double FineAngle(double a, double b) {
  const bool steep = a > b;
  const double low = steep ? b : a, high = steep ? a : b;
  const bool far = low > 0.66 * high;
  const double over = far ? low - high : low, under = far ? low + high : high;
  const double t = over / (under > 0 ? under : 1.0), z = t * t;
  double p = -8.750608600031904122785e-1;
  p = p * z - 1.615753718733365076637e1;
  p = p * z - 7.500855792314704667340e1;
  p = p * z - 1.228866684490136173410e2;
  p = p * z - 6.485021904942025371773e1;
  double q = z + 2.485846490142306297962e1;
  q = q * z + 1.650270098316988542046e2;
  q = q * z + 4.328810604912902668951e2;
  q = q * z + 4.853903996359136964868e2;
  q = q * z + 1.945506571482613964425e2;
  const double angle = (t + t * z * p / q) + (far ? 0.785398163397448309616 : 0.0);
  return steep ? 1.57079632679489661923 - angle : angle;
}

GROUSER_INLINE void WriteEchoes(const Block& b, const Scratch& s, Unwanted* unwanted, int n) {
  double* __restrict slip = Or(b.slip, unwanted->part[0]);
  double* __restrict angle = Or(b.attack_angle, unwanted->part[1]);
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const double x = s.v_x[i], y = s.v_y[i], rim = s.v_rim[i];
    const double front = FineAngle(y < 0 ? -y : y, x < 0 ? -x : x);
    const double whole = x < 0 ? 3.14159265358979323846 - front : front;
    slip[i] = rim * s.inverse_speed[i] - x * s.inverse_speed[i];
    angle[i] = y < 0 ? -whole : whole;
  }
}
