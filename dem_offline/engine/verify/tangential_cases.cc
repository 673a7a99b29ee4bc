// Oblique impacts, and tangential laws by displacement control.
#include <algorithm>

#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/benchmarks.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

// Oblique impact: Chung & Ooi (2011), test 4.

constexpr char kTest4[] = "Chung & Ooi 2011, test 4";
constexpr double kAluminaRadius = 0.0025, kAluminaSpeed = 3.9, kAluminaFriction = 0.092,
                 kAluminaRestitution = 0.98;

struct Rebound {
  double restitution;  ///< of the tangential velocity of the centre
  double spin;         ///< [rad/s], negative as published
  double patch_angle_deg;
};

Rebound Strike(const char* tangential, double degrees) {
  const double a = degrees * M_PI / 180, v_t = kAluminaSpeed * std::sin(a),
               v_n = kAluminaSpeed * std::cos(a);
  const ContactModel model =
      Model({.tangential = tangential}, {380e9, 0.23},
            {.restitution = kAluminaRestitution, .friction = kAluminaFriction});
  World world(
      Cell(model, 0.05, 1e-9),
      Scene({{0.02, 0.025, kAluminaRadius, kAluminaRadius, 4000, v_t, 0, -v_n}}, {Floor()}));
  const GrainState out = Follow(world).after;
  const double patch = out.v_x - kAluminaRadius * out.w_y;
  return {out.v_x / v_t, -out.w_y, std::atan(patch / v_n) * 180 / M_PI};
}

void PublishedCurve(Rows& rows) {
  double worst_spin = 0, worst_angle = 0;
  for (const auto& p : kOblique) {
    const Rebound got = Strike("mindlin_displacement", p[0]);
    rows.Absolute(Format("tangential restitution at %g deg [-]", p[0]), p[1], got.restitution,
                  0.025, kTest4);
    worst_spin = std::max(worst_spin, std::abs(got.spin - p[2]));
    worst_angle = std::max(worst_angle, std::abs(got.patch_angle_deg - p[3]));
  }
  rows.AtMost("spin, worst of 13 angles, over the largest published [-]", 0.025, worst_spin / 616.5,
              kTest4);
  rows.AtMost("rebound angle, worst of 13 angles, over the largest published [-]", 0.025,
              worst_angle / 84.52, kTest4);
}

void FullSliding(Rows& rows) {
  for (const char* law : {"mindlin_displacement", "mindlin"}) {
    for (const double degrees : {40.0, 60.0, 80.0}) {
      const double v_n = kAluminaSpeed * std::cos(degrees * M_PI / 180);
      const double spin = 2.5 * kAluminaFriction * (1 + kAluminaRestitution) * v_n / kAluminaRadius;
      rows.Relative(Format("%s: spin at %g deg [rad/s]", law, degrees), spin,
                    -Strike(law, degrees).spin, 0.002, "full sliding: 2.5 mu (1+e) vn/r");
    }
  }
}

/// The rescaled law only dissipates; the published curve was made with
/// F = k_t(a) xi, which gives energy when a sheared contact is loaded.
void RescaledLaw(Rows& rows) {
  double worst = 0;
  for (const auto& p : kOblique) {
    if (p[0] < 15) continue;
    worst = std::max(worst, std::abs(Strike("mindlin", p[0]).restitution - p[1]));
  }
  rows.AtMost("tangential restitution from 15 deg on, worst distance [-]", 0.025, worst, kTest4);
}

// Tangential laws by displacement control: two grains held by hand at a fixed
// overlap, one drawn sideways, back, and forward again.

constexpr double kHeldRadius = 0.001, kHeldOverlap = 1e-5, kHeldFriction = 0.3, kHeldStep = 1e-5;
const Elastic kHeldGrain = {1e7, 0.3};

/// A contact under a constant push. At a stroke [m] it has moved so far.
class HeldPair {
 public:
  explicit HeldPair(const Laws& laws, double friction = kHeldFriction)
      : world_(Cell(Model(laws, kHeldGrain, {.restitution = 1, .friction = friction}), 0.02,
                    kHeldStep),
               Grains()) {
    world_.Start();
    RunOrThrow(world_, 1);
  }
  double stroke() const { return world_.StateOf(1).x_m - 0.01; }
  /// Along the contact normal, which tilts as the grain goes, and across [N].
  double push() const {
    const auto n = Normal();
    const GrainLoad& f = world_.LoadOf(1);
    return f.fx * n[0] + f.fz * n[1];
  }
  /// What holds grain 1 back.
  double drag() const {
    const auto n = Normal();
    const GrainLoad& f = world_.LoadOf(1);
    return -(f.fx * n[1] - f.fz * n[0]);
  }

  /// Goes to a stroke in so many steps; the work put in [J].
  double Go(double to, int steps) {
    const double v = (to - stroke()) / (steps * kHeldStep);
    world_.SetVelocity(1, {v, 0, 0}, {0, 0, 0});
    double work = 0, last = drag();
    for (int s = 0; s < steps; ++s) {
      RunOrThrow(world_, 1);
      work += 0.5 * (last + drag()) * v * kHeldStep;
      last = drag();
    }
    return work;
  }

 private:
  static std::vector<GrainState> Grains() {
    GrainState low = {0.01, 0.01, 0, kHeldRadius, 2500}, high = low;
    low.glued = high.glued = true;
    high.z_m = 2 * kHeldRadius - kHeldOverlap;
    return {low, high};
  }
  std::array<double, 2> Normal() const {
    const GrainState a = world_.StateOf(0), b = world_.StateOf(1);
    const double dx = b.x_m - a.x_m, dz = b.z_m - a.z_m, d = std::hypot(dx, dz);
    return {dx / d, dz / d};
  }
  World world_;
};

double MindlinStiffness() {
  return 8 * EffectiveShearModulus(kHeldGrain, kHeldGrain) *
         std::sqrt(0.5 * kHeldRadius * kHeldOverlap);
}

/// First stiffness and the force once it slides, of every law.
void StiffnessAndCap(Rows& rows) {
  const double ratio = 2.0 / 7;
  const double linear = ratio * 4.0 / 3 * EffectiveModulus(kHeldGrain, kHeldGrain) *
                        std::sqrt(0.5 * kHeldRadius * kHeldOverlap);
  const struct {
    const char* law;
    double stiffness;
  } laws[] = {{"mindlin", MindlinStiffness()},
              {"mindlin_displacement", MindlinStiffness()},
              {"mindlin_deresiewicz", MindlinStiffness()},
              {"linear_history", linear},
              {"kelvin_regularised", 1.5 * linear}};
  for (const auto& law : laws) {
    const double stiffness = law.stiffness;
    HeldPair held({.tangential = law.law,
                   .settings = {{"linear_history", "stiffness_ratio", ratio},
                                {"linear_history", "critical_damping_share", 0},
                                {"kelvin_regularised", "stiffness_ratio", 1.5 * ratio},
                                {"kelvin_regularised", "critical_damping_share", 0}}});
    const double slide = kHeldFriction * held.push() / stiffness;
    held.Go(2e-3 * slide, 100);
    rows.Relative(Format("%s: first stiffness [N/m]", law.law), stiffness,
                  held.drag() / held.stroke(), 0.005, "the law's own k_t");
    held.Go(5 * slide, 2000);
    rows.Relative(Format("%s: sliding force over the push [-]", law.law), kHeldFriction,
                  held.drag() / held.push(), 0.002, "Coulomb");
  }
}

/// Loading, unloading and a closed loop at constant push, against the closed
/// form: T = mu N (1 - (1 - s/s_m)^(3/2)), s_m = 3 mu N/(2 k_t).
void Deresiewicz(Rows& rows) {
  HeldPair held({.tangential = "mindlin_deresiewicz"});
  const double cap = kHeldFriction * held.push(), most = 1.5 * cap / MindlinStiffness();
  const auto virgin = [&](double s) { return cap * (1 - std::pow(1 - s / most, 1.5)); };
  const double turn = 0.7 * most;
  double worst = 0;
  for (int k = 1; k <= 7; ++k) {
    held.Go(0.1 * k * most, 300);
    worst = std::max(worst, std::abs(held.drag() - virgin(held.stroke())) / cap);
  }
  const char* source = "Mindlin & Deresiewicz 1953";
  rows.AtMost("mindlin_deresiewicz: loading curve, largest distance [mu N]", 0.005, worst, source);
  const double top = virgin(turn);
  const auto back = [&](double s) {
    return top - 2 * cap * (1 - std::pow(1 - (turn - s) / (2 * most), 1.5));
  };
  worst = 0;
  double work = 0;
  for (int k = 6; k >= -7; --k) {
    work += held.Go(0.1 * k * most, 300);
    worst = std::max(worst, std::abs(held.drag() - back(held.stroke())) / cap);
  }
  rows.AtMost("mindlin_deresiewicz: unloading curve, largest distance [mu N]", 0.01, worst, source);
  for (int k = -6; k <= 7; ++k) work += held.Go(0.1 * k * most, 300);
  // Area of the loop between the two curves, by quadrature.
  double area = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const double s = -turn + 2 * turn * (i + 0.5) / n;
    area += (-back(-s) - back(s)) * 2 * turn / n;
  }
  rows.Relative("mindlin_deresiewicz: energy of a closed loop [nJ]", 1e9 * area, 1e9 * work, 0.02,
                source);
}

/// A closed cycle of a spring with a slider loses 4 mu N (s - mu N/k).
void Sliders(Rows& rows) {
  for (const char* law : {"mindlin", "mindlin_displacement", "linear_history"}) {
    HeldPair held({.tangential = law,
                   .settings = {{"linear_history", "stiffness_ratio", 0.3},
                                {"linear_history", "critical_damping_share", 0}}});
    const double stiffness = std::string(law) == "linear_history"
                                 ? 0.3 * 4.0 / 3 * EffectiveModulus(kHeldGrain, kHeldGrain) *
                                       std::sqrt(0.5 * kHeldRadius * kHeldOverlap)
                                 : MindlinStiffness();
    const double cap = kHeldFriction * held.push(), s = 3 * cap / stiffness;
    held.Go(s, 3000);
    const double work = held.Go(-s, 3000) + held.Go(s, 3000);
    rows.Relative(Format("%s: energy of a closed cycle with slip [nJ]", law),
                  4e9 * cap * (s - cap / stiffness), 1e9 * work, 0.005, "spring and slider");
  }
}

/// The element's dashpot, and its friction that falls with speed.
void Kelvin(Rows& rows) {
  const double stick = std::tan(27 * M_PI / 180), slide = std::tan(25 * M_PI / 180);
  const std::vector<Setting> settings = {{"kelvin_regularised", "stick_friction", stick},
                                         {"kelvin_regularised", "slide_friction", slide},
                                         {"kelvin_regularised", "sticking_speed_m_per_s", 0.01},
                                         {"kelvin_regularised", "stiffness_ratio", 0.4},
                                         {"kelvin_regularised", "critical_damping_share", 0.1}};
  HeldPair slow({.tangential = "kelvin_regularised", .settings = settings});
  slow.Go(4e-5, 40000);
  rows.Relative("kelvin_regularised: friction at a hundredth of the sticking speed [-]",
                stick + 0.01 * (slide - stick), slow.drag() / slow.push(), 0.002,
                "tan 27 deg (reference 4)");
  HeldPair fast({.tangential = "kelvin_regularised", .settings = settings});
  fast.Go(4e-5, 200);
  rows.Relative("kelvin_regularised: friction at twice the sticking speed [-]", slide,
                fast.drag() / fast.push(), 0.002, "tan 25 deg (reference 4)");
  HeldPair touched({.tangential = "kelvin_regularised", .settings = settings});
  const double v = 1e-5, mass = SphereMass(kHeldRadius, 2500) / 2;
  const double stiffness = 0.4 * 4.0 / 3 * EffectiveModulus(kHeldGrain, kHeldGrain) *
                           std::sqrt(0.5 * kHeldRadius * kHeldOverlap);
  touched.Go(v * kHeldStep, 1);
  rows.Relative("kelvin_regularised: first force at 1e-5 m/s [uN]",
                1e6 * (stiffness * v * kHeldStep + 0.2 * std::sqrt(stiffness * mass) * v),
                1e6 * touched.drag(), 0.005, "k v dt + 2 zeta sqrt(k m*) v");
}

}  // namespace

Cases TangentialCases() {
  return {{"oblique_impact", Level::kQuick, PublishedCurve},
          {"oblique_sliding", Level::kQuick, FullSliding},
          {"oblique_rescaled", Level::kQuick, RescaledLaw},
          {"tangential_stiffness", Level::kQuick, StiffnessAndCap},
          {"tangential_deresiewicz", Level::kQuick, Deresiewicz},
          {"tangential_sliders", Level::kQuick, Sliders},
          {"tangential_kelvin", Level::kQuick, Kelvin}};
}

}  // namespace grouser::dem::verify
