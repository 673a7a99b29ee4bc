#include "dem_offline/engine/experiment/rings.h"

#include <cmath>

#include "dem_offline/engine/experiment/scatter.h"

namespace grouser::dem::experiment {

RingSums::RingSums(const Probe& p, const BoxSpec& box)
    : middle_(Scale(0.5, dem::Add(p.region.low_m, p.region.high_m))),
      inner_(p.region.inner_radius_m),
      width_((p.region.radius_m - p.region.inner_radius_m) / p.rings),
      axis_(AxisOf(box)),
      sums_(static_cast<std::size_t>(p.rings)) {}

double RingSums::Low(std::size_t ring) const { return inner_ + static_cast<double>(ring) * width_; }

void RingSums::AddOne(const Vec3d& x, const Vec3d& v, double diameter) {
  // Right-handed: (u, w) turn about the axis from u to w.
  const int u = (axis_ + 1) % 3, w = (axis_ + 2) % 3;
  const double du = x[u] - middle_[u], dw = x[w] - middle_[w], rho = std::hypot(du, dw);
  const double place = (rho - inner_) / width_;
  if (!(place >= 0 && place < static_cast<double>(sums_.size()))) return;
  Sum& s = sums_[static_cast<std::size_t>(place)];
  const double r = (v[u] * du + v[w] * dw) / rho, t = (v[w] * du - v[u] * dw) / rho;
  s.n += 1;
  s.d2 += diameter * diameter;
  s.t += t;
  s.r += r;
  s.tt += t * t;
  s.rr += r * r;
}

void RingSums::Add(const Ground& ground) {
  const World& world = ground.world();
  samples_ += 1;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    if (world.grains()[i].kind & kMember) continue;
    const GrainState s = ground.At(i);
    AddOne({s.x_m, s.y_m, s.z_m}, {s.v_x, s.v_y, s.v_z}, 2 * s.radius_m);
  }
  for (const ClumpEntry& c : world.state().clumps) {
    const double volume = world.state().templates[c.state.shape].volume_m3;
    AddOne(c.state.position_m, c.state.velocity_m_per_s, std::cbrt(6 / M_PI * volume));
  }
}

std::vector<RingMean> RingSums::Take() {
  std::vector<RingMean> out;
  for (std::size_t k = 0; k < sums_.size(); ++k) {
    const Sum& s = sums_[k];
    const double low = Low(k), high = Low(k + 1), n = std::max(s.n, 1.0);
    RingMean m;
    m.grains = s.n / samples_;
    m.areal_fraction = 0.25 * s.d2 / samples_ / (high * high - low * low);
    m.tangential_m_per_s = s.t / n;
    m.radial_m_per_s = s.r / n;
    m.temperature_m2_per_s2 = (s.tt / n - m.tangential_m_per_s * m.tangential_m_per_s + s.rr / n -
                               m.radial_m_per_s * m.radial_m_per_s) /
                              3;
    out.push_back(m);
  }
  sums_.assign(sums_.size(), {});
  samples_ = 0;
  return out;
}

}  // namespace grouser::dem::experiment
