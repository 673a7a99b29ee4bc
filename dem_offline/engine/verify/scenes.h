#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dem_offline/engine/gpu/device.h"
#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/engine/world/world.h"

// Small scenes that several cases share.

namespace grouser::dem::verify {

/// While it lives, the Worlds that this thread's cases make are stepped on a
/// device (null: by these cores). A case is a plain function, whose thread knows
/// where it runs.
class Placement {
 public:
  explicit Placement(std::shared_ptr<gpu::Device> device);
  ~Placement();
  Placement(const Placement&) = delete;
  Placement& operator=(const Placement&) = delete;
};

/// For cases about the bits of these cores; throws NotElsewhere on a device.
void ExpectCores();

/// A wheel test of a case.
WheelTestResult RunWheel(const WheelTestSpec& spec, const Tile& tile);

/// A World of a case.
class World : public dem::World {
 public:
  World(const WorldConfig& config, const Contents& contents);
  World(const WorldConfig& config, const std::vector<GrainState>& grains);
};

/// One setting of one law, by name.
struct Setting {
  const char* law;
  const char* field;
  double value;
};
/// A choice of laws with their own settings.
struct Laws {
  const char* normal = "hertz_restitution";
  const char* tangential = "mindlin";
  const char* rolling = "none";
  const char* cohesion = "none";
  std::vector<Setting> settings = {};
};
inline Laws LinearSprings(double n_per_m, const char* rolling = "none") {
  return {.normal = "linear_spring",
          .tangential = "linear_history",
          .rolling = rolling,
          .settings = {{"linear_spring", "stiffness_n_per_m", n_per_m}}};
}
/// Throws std::invalid_argument for a law or field that the registry has not.
LawSettings SettingsFor(const std::vector<Setting>& settings);
/// Grains of one material (0) and rigid bodies (1), all with interface `f`.
ContactModel Model(const Laws& laws, const Elastic& grains, const ContactProperties& f);

/// An empty cube without gravity, periodic in x and y, z from -2 to 2 sizes.
WorldConfig Cell(const ContactModel& contacts, double size_m, double dt_s);

/// A rigid half space: solid on the far side of `point` seen along `normal`.
Body Plane(Vec3d normal, Vec3d point);
inline Body Floor(double z_m = 0) { return Plane({0, 0, 1}, {0, 0, z_m}); }
/// A rigid box of full sizes, turned about y.
Body Block(Vec3d centre, Vec3d size, double turn_about_y_rad = 0);

/// Grains and bodies, nothing else.
Contents Scene(std::vector<GrainState> grains, std::vector<Body> bodies = {});

/// Steps, throwing std::runtime_error with the fault and the time.
void RunOrThrow(World& world, std::int64_t steps);

/// A head-on collision of grain 0 with a wall at z = 0 or with grain 1.
struct Impact {
  double peak_overlap_m = 0, peak_force_n = 0, contact_s = 0;
  GrainState after;
  std::vector<std::array<double, 3>> curve;  ///< time [s], overlap [m], force [N]
};
/// Steps until grain 0 has touched and parted again.
Impact Follow(World& world, bool keep_curve = false);

/// Root mean square distance of published points from a computed curve y(x),
/// over the largest published y: `points` {x, y} pairs, `x` and `y` columns of the curve.
double CurveDeviation(const std::vector<std::array<double, 2>>& points,
                      const std::vector<std::array<double, 3>>& curve, int x, int y);

inline double SphereMass(double radius_m, double density) {
  return 4.0 / 3.0 * M_PI * radius_m * radius_m * radius_m * density;
}
/// Elastic Hertz impact: m* (reduced mass), R*, E*, approach speed.
struct HertzImpact {
  double overlap_m, force_n, contact_s;
};
HertzImpact ExactHertz(double m_eff, double r_eff, double e_star, double speed);

/// Classic Runge-Kutta in double; f(t, y) -> dy/dt. The reference solutions.
template <std::size_t N, class F>
std::array<double, N> RungeKutta(F&& f, double t, std::array<double, N> y, double h) {
  const auto add = [](std::array<double, N> a, const std::array<double, N>& k, double s) {
    for (std::size_t i = 0; i < N; ++i) a[i] += s * k[i];
    return a;
  };
  const auto k1 = f(t, y), k2 = f(t + h / 2, add(y, k1, h / 2)),
             k3 = f(t + h / 2, add(y, k2, h / 2)), k4 = f(t + h, add(y, k3, h));
  for (std::size_t i = 0; i < N; ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  return y;
}

/// Restitution of a force law F(overlap, overlap rate) for a reduced mass and
/// an approach speed, by Runge-Kutta with `steps` to the contact time. The
/// contact ends where the overlap is used up.
double ExactRestitution(const std::function<double(double, double)>& force, double m_eff,
                        double speed, double contact_s, int steps = 20000);

}  // namespace grouser::dem::verify
