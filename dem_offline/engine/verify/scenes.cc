#include "dem_offline/engine/verify/scenes.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dem_offline/engine/gpu/rig.h"
#include "dem_offline/engine/gpu/stepper.h"
#include "dem_offline/engine/laws/material.h"

namespace grouser::dem::verify {
namespace {

thread_local std::shared_ptr<gpu::Device> placed;

WorldConfig Placed(WorldConfig config) {
  if (placed) config.stepper = gpu::StepperOn(placed);
  return config;
}

}  // namespace

Placement::Placement(std::shared_ptr<gpu::Device> device) { placed = std::move(device); }
Placement::~Placement() { placed = nullptr; }

void ExpectCores() {
  if (placed) throw NotElsewhere("about the bits of a CPU; grouser-gpu-check looks at a device's");
}

WheelTestResult RunWheel(const WheelTestSpec& spec, const Tile& tile) {
  if (placed) return gpu::RunWheelTests({{spec, &tile}}, *placed)[0];
  return RunWheelTest(spec, tile, nullptr);
}

World::World(const WorldConfig& config, const Contents& contents)
    : dem::World(Placed(config), contents) {}
World::World(const WorldConfig& config, const std::vector<GrainState>& grains)
    : dem::World(Placed(config), grains) {}
namespace {

template <class List>
bool SetIn(LawSettings& all, const Setting& s) {
  bool found = false;
  List::ForEach([&](auto law) {
    using Law = decltype(law);
    if (std::string(Law::kName) != s.law) return;
    Law::Fields(SettingsOf<Law>(all), [&](const char* name, auto& field) {
      if (std::string(name) != s.field) return;
      field = s.value;
      found = true;
    });
  });
  return found;
}

}  // namespace

LawSettings SettingsFor(const std::vector<Setting>& settings) {
  LawSettings out;
  for (const Setting& s : settings) {
    const bool found = SetIn<NormalLaws>(out, s) | SetIn<TangentialLaws>(out, s) |
                       SetIn<RollingLaws>(out, s) | SetIn<CohesionLaws>(out, s);
    if (!found) {
      throw std::invalid_argument(std::string(s.law) + " has no setting " + s.field);
    }
  }
  return out;
}

ContactModel Model(const Laws& laws, const Elastic& grains, const ContactProperties& f) {
  return OneMaterial(grains, f,
                     LawsByName(laws.normal, laws.tangential, laws.rolling, laws.cohesion),
                     SettingsFor(laws.settings));
}

WorldConfig Cell(const ContactModel& contacts, double size_m, double dt_s) {
  WorldConfig c;
  c.frame = {size_m, size_m, 4 * size_m};
  c.gravity_m_per_s2 = {0, 0, 0};
  c.dt_s = dt_s;
  c.contacts = contacts;
  return c;
}

Body Plane(Vec3d normal, Vec3d point) {
  Body body;
  body.shape = HalfSpace(normal.data());
  body.position_m = point;
  return body;
}

Body Block(Vec3d centre, Vec3d size, double turn_about_y_rad) {
  Body body;
  body.shape = Box(size[0], size[1], size[2]);
  body.position_m = centre;
  body.orientation = {std::cos(turn_about_y_rad / 2), 0, std::sin(turn_about_y_rad / 2), 0};
  return body;
}

Contents Scene(std::vector<GrainState> grains, std::vector<Body> bodies) {
  Contents out;
  out.grains = std::move(grains);
  out.bodies = std::move(bodies);
  return out;
}

void RunOrThrow(World& world, std::int64_t steps) {
  const StepFault fault = world.Run(steps);
  if (fault == StepFault::kNone) return;
  throw std::runtime_error(std::string(Explain(fault)) + " at " + std::to_string(world.time_s()) +
                           " s");
}

Impact Follow(World& world, bool keep_curve) {
  Impact out;
  const bool pair = world.count() > 1;
  bool touched = false;
  for (std::int64_t s = 0; s < 20000000; ++s) {
    RunOrThrow(world, 1);
    const GrainLoad& f = world.LoadOf(0);
    if (f.touching > 0) {
      touched = true;
      const GrainState a = world.StateOf(0);
      double overlap = a.radius_m - a.z_m;
      if (pair) {
        const GrainState b = world.StateOf(1);
        overlap = a.radius_m + b.radius_m - std::abs(a.z_m - b.z_m);
      }
      const double force = f.fz;
      out.contact_s += world.config().dt_s;
      out.peak_force_n = std::max(out.peak_force_n, std::abs(force));
      out.peak_overlap_m = std::max(out.peak_overlap_m, overlap);
      if (keep_curve) out.curve.push_back({out.contact_s, overlap, std::abs(force)});
    } else if (touched) {
      out.after = world.StateOf(0);
      return out;
    }
  }
  throw std::runtime_error("the grains never parted");
}

double CurveDeviation(const std::vector<std::array<double, 2>>& points,
                      const std::vector<std::array<double, 3>>& curve, int x, int y) {
  double scale = 0, sum = 0;
  for (const auto& p : points) {
    scale = std::max(scale, std::abs(p[1]));
    // The branch of the curve that lies nearest (a loop passes x twice).
    double best = std::abs(p[1]);  // before the first and after the last point it is zero
    const double end = curve.back()[x];
    if (p[0] > curve.front()[x] && (x != 0 || p[0] < end)) best = 1e300;
    for (std::size_t k = 1; k < curve.size(); ++k) {
      const double a = curve[k - 1][x], b = curve[k][x];
      if ((a - p[0]) * (b - p[0]) > 0) continue;
      const double t = a == b ? 0.5 : (p[0] - a) / (b - a);
      best =
          std::min(best, std::abs(p[1] - (curve[k - 1][y] + t * (curve[k][y] - curve[k - 1][y]))));
    }
    sum += best * best;
  }
  return std::sqrt(sum / static_cast<double>(points.size())) / scale;
}

HertzImpact ExactHertz(double m_eff, double r_eff, double e_star, double speed) {
  HertzImpact h;
  const double k = 4.0 / 3.0 * e_star * std::sqrt(r_eff);
  h.overlap_m = std::pow(1.25 * m_eff * speed * speed / k, 0.4);
  h.force_n = k * std::pow(h.overlap_m, 1.5);
  // 2 int_0^1 dx/sqrt(1 - x^(5/2)) = (4/5) sqrt(pi) Gamma(2/5)/Gamma(9/10)
  const double loop = 0.8 * std::sqrt(M_PI) * std::tgamma(0.4) / std::tgamma(0.9);
  h.contact_s = loop * h.overlap_m / speed;
  return h;
}

double ExactRestitution(const std::function<double(double, double)>& force, double m_eff,
                        double speed, double contact_s, int steps) {
  const double h = contact_s / steps;
  std::array<double, 2> y = {0, speed};
  for (int s = 0; s < 20 * steps; ++s) {
    const auto last = y;
    y = RungeKutta<2>(
        [&](double, const std::array<double, 2>& u) {
          return std::array<double, 2>{u[1], -force(std::max(u[0], 0.0), u[1]) / m_eff};
        },
        0, y, h);
    if (y[0] <= 0 && y[1] < 0) {
      const double t = last[0] / (last[0] - y[0]);
      return -(last[1] + t * (y[1] - last[1])) / speed;
    }
  }
  throw std::runtime_error("the reference solution never parted");
}

}  // namespace grouser::dem::verify
