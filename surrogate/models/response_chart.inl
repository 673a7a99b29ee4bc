// Part of response_kernel.inl: from velocities and loads to chart coordinates,
// spline weights and hull terms of a block, loops that a compiler vectorises.

// Everything between the stages; one block, a few KiB.
struct Scratch {
  alignas(64) double v_x[kBlock], v_y[kBlock], v_rim[kBlock], load[kBlock];  // ordinary ones
  double inverse_speed[kBlock];                                              // 1/M [s/m]
  double special[kBlock], flags[kBlock];                // bits, as numbers: one width vectorises
  float forward[kBlock], lateral[kBlock], rim[kBlock];  // canonical, over M
  float plane[kBlock];                                  // hypot(forward, rim)
  float mirror[kBlock], sign_x[kBlock], sign_y[kBlock];
  float excess[kBlock], distance2[kBlock], bulldozing[kBlock];
  float u[kBlock], steepness[kBlock];  // of SpeedAxis; du/dM, 0 beyond its end
  float fast[kBlock];                  // by how much beyond the runs' speeds
  float hub_first[kBlock];             // 1: M is V, 0: it is |r w|
  int node[kBlock];                    // first float of the 4 x 4 x 4 nodes
  float direction[kBlock], height[kBlock], log_load[kBlock];
  float weight[3][4][kBlock], slope[3][4][kBlock];
  float channel[5][kGroup][kBlock];  // value, then by direction, lateral, log load; by u
};

// atan2(a, b) for a, b >= 0, 0 for both 0; error below 2e-7 (Cephes' atanf).
GROUSER_INLINE float Angle(float a, float b) {
  const bool steep = a > b;
  const float low = steep ? b : a, high = steep ? a : b;
  const bool far = low > 0.41421356f * high;  // tan(pi/8)
  const float over = far ? low - high : low, under = far ? low + high : high;
  const float t = over / (under > 0 ? under : 1.0f), z = t * t;
  float p = 8.05374449538e-2f;
  p = p * z - 1.38776856032e-1f;
  p = p * z + 1.99777106478e-1f;
  p = p * z - 3.33329491539e-1f;
  const float angle = (p * z * t + t) + (far ? 0.78539816f : 0.0f);
  return steep ? 1.57079633f - angle : angle;
}

// ln x for normal positive x; error below 2e-7 (1 + |ln x|).
GROUSER_INLINE float Log(float x) {
  const int bits = __builtin_bit_cast(int, x);
  const int exponent = (bits - 0x3f3504f3) >> 23;  // of x over sqrt(1/2)
  const float m = __builtin_bit_cast(float, bits - exponent * (1 << 23));
  const float f = (m - 1) / (m + 1), z = f * f;
  float p = 2.0f / 9;
  p = p * z + 2.0f / 7;
  p = p * z + 2.0f / 5;
  p = p * z + 2.0f / 3;
  return (p * z * f + 2 * f) + static_cast<float>(exponent) * 0.69314718f;
}

// Copies the states, with an ordinary one in place of those that the table does
// not answer, so that nothing below can trap or wander.
GROUSER_INLINE void Admit(const Constants& c, Block* b, Scratch* s, int n) {
  const double *v_x = b->v_x, *v_y = b->v_y, *v_rim = b->rim, *v_load = b->load;
  const double lowest = c.lowest_load, highest = c.highest_load, middle = c.load_low;
  const double blend_low = c.blend_low, blend_high = c.blend_high;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const double x = v_x[i], y = v_y[i], q = v_rim[i], load = v_load[i];
    const double sum2 = x * x + y * y + q * q;
    const bool usable = (sum2 >= 1e-200) & (sum2 <= 1e200) & (load >= lowest) & (load <= highest);
    s->v_x[i] = usable ? x : 1.0;  // NaN is not usable
    s->v_y[i] = usable ? y : 0.0;
    s->v_rim[i] = usable ? q : 1.0;
    s->load[i] = usable ? load : middle;
    const double edge = (load < blend_low) | (load > blend_high) ? double{kBlend} : 0.0;
    s->special[i] = usable ? edge : double{kOff};
  }
  for (int i = 0; i < n; ++i) b->special[i] = static_cast<std::uint32_t>(int(s->special[i]));
}

// The canonical state, its signs and Hull::Outside.
GROUSER_INLINE void ToCanonical(const Constants& c, Scratch* s, int n) {
  const double slip_low = c.slip_low, slip_high = c.slip_high, rim_faster = c.rim_faster;
  const double angle_sin = c.angle_sin, angle_cos = c.angle_cos, fastest2 = c.fastest2;
  const double load_low = c.load_low, load_high = c.load_high;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const double x = s->v_x[i], y = s->v_y[i], q = s->v_rim[i], load = s->load[i];
    const double hub2 = x * x + y * y, rim2 = q * q;
    const double speed2 = hub2 > rim2 ? hub2 : rim2;
    const double inverse = 1.0 / __builtin_sqrt(speed2);
    const double sense = x != 0 ? x : q;  // which decides the mirror in x
    const double mirror = sense < 0 ? -1.0 : 1.0, side = y < 0 ? -1.0 : 1.0;
    const double p = (x < 0 ? -x : x) * inverse, r = mirror * q * inverse;
    const double lateral = side * y * inverse, hub = __builtin_sqrt(hub2) * inverse;
    const double slip = r - p;
    const bool outside = (slip < slip_low) | (slip > slip_high) | ((r < 0) & (hub < rim_faster)) |
                         (lateral * angle_cos > p * angle_sin) | (load < load_low) |
                         (load > load_high);
    s->flags[i] =
        (outside ? double{kExtrapolated} : 0.0) + (speed2 > fastest2 ? double{kRate} : 0.0);
    s->inverse_speed[i] = inverse;
    s->forward[i] = static_cast<float>(p);
    s->lateral[i] = static_cast<float>(lateral);
    s->rim[i] = static_cast<float>(r);
    s->mirror[i] = static_cast<float>(mirror);
    s->sign_x[i] = static_cast<float>(sense != 0 ? mirror : 0.0);
    s->sign_y[i] = static_cast<float>(y != 0 ? side : 0.0);
  }
}

// Where the speed stands on its axis, and beyond the runs.
template <bool kGradients>
GROUSER_INLINE void ToSpeed(const Constants& c, Scratch* s, int n) {
  const double per = c.froude_per_speed2, high = c.froude_high, saturation = c.saturation;
  const double reference = c.scale_reference;
  const double inverse_fastest = c.inverse_fastest, most = c.most_fast;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const double x = s->v_x[i], y = s->v_y[i], q = s->v_rim[i];
    const double hub2 = x * x + y * y, rim2 = q * q;
    const double speed2 = hub2 > rim2 ? hub2 : rim2;
    const double speed = speed2 * s->inverse_speed[i];
    const double froude = speed2 * per, beyond = speed * inverse_fastest - 1;
    const double bounded = froude < high ? froude : high, part = 1 / (1 + saturation * bounded);
    s->u[i] = static_cast<float>(bounded * part - reference);
    s->fast[i] = static_cast<float>(beyond > 0 ? (beyond < most ? beyond : most) : 0.0);
    if (!kGradients) continue;
    s->steepness[i] = static_cast<float>(froude < high ? 2 * per * speed * part * part : 0.0);
    s->hub_first[i] = hub2 > rim2 ? 1.0f : 0.0f;
  }
}

// Chart coordinates in node units, Hull::Excess and Hull::Bulldozing.
GROUSER_INLINE void ToChart(const Constants& c, Scratch* s, int n) {
  constexpr float kPi = 3.14159265f;
  const float per_direction = static_cast<float>(c.direction) / kPi;
  const float per_lateral = static_cast<float>(c.lateral) / (kPi / 2);
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float p = s->forward[i], r = s->rim[i], y = s->lateral[i];
    const float spin = r < 0 ? -r : r;
    const float plane = __builtin_sqrtf(p * p + r * r);
    const float angle = Angle(spin, p);
    const float log_load = Log(static_cast<float>(s->load[i]));
    s->plane[i] = plane;
    s->direction[i] = ((r < 0 ? -angle : angle) + kPi / 2) * per_direction;
    s->height[i] = Angle(y, plane) * per_lateral;
    s->log_load[i] = (log_load - c.log_load_min) * c.load_per_log;
    const float braking = c.slip_min - (r - p), lateral = y - c.most_lateral;
    const float driving = (spin - (r < 0 ? -p : p)) - c.slip_max;
    const float inverse = 1.0f / (plane > 0 ? plane : 1.0f);
    const float brake = p > r ? p - r : 0.0f;
    const float share = y * y + brake * brake * (p * inverse);
    s->bulldozing[i] = share < 1 ? share : 1.0f;
    const float light = c.log_low - log_load, heavy = log_load - c.log_high;
    s->excess[i] = ((braking > 0 ? braking : 0.0f) * (p * inverse) +
                    (driving > 0 ? driving : 0.0f) * (spin * inverse)) *
                       c.per_slip +
                   (lateral > 0 ? lateral : 0.0f) * c.per_lateral +
                   ((light > 0 ? light : 0.0f) + (heavy > 0 ? heavy : 0.0f)) * c.per_log_load +
                   s->fast[i] * c.per_fast;
  }
}

// Uniform cubic B-spline weights and their slopes [per interval] on one axis;
// adds the first node's place. Beyond a clamped axis the slope is `outside`.
template <bool kGradients>
GROUSER_INLINE void ToWeights(const float* at, int intervals, int stride, float outside,
                              float (*weight)[kBlock], float (*slope)[kBlock], int* node, int n) {
  const float last = static_cast<float>(intervals);
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float u = at[i] > 0 ? (at[i] < last ? at[i] : last) : 0.0f;
    const int floor = static_cast<int>(u), cell = floor < intervals ? floor : intervals - 1;
    const float f = u - static_cast<float>(cell), g = 1 - f;
    node[i] += cell * stride;
    weight[0][i] = g * g * g * (1.0f / 6);
    weight[1][i] = (4 + 3 * f * f * (f - 2)) * (1.0f / 6);
    weight[2][i] = (4 + 3 * g * g * (g - 2)) * (1.0f / 6);
    weight[3][i] = f * f * f * (1.0f / 6);
    if (kGradients) {
      const float scale = (at[i] < 0) | (at[i] > last) ? outside : 1.0f;
      slope[0][i] = -0.5f * g * g * scale;
      slope[1][i] = 0.5f * f * (3 * f - 4) * scale;
      slope[2][i] = -0.5f * g * (3 * g - 4) * scale;
      slope[3][i] = 0.5f * f * f * scale;
    }
  }
}
