// Oblique impact: Chung & Ooi (2011), test 4.
#include "dem_offline/engine/verify/benchmarks.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

constexpr char kTest4[] = "Chung & Ooi 2011, test 4";
constexpr double kRadius = 0.0025, kSpeed = 3.9, kFriction = 0.092, kRestitution = 0.98;

struct Rebound {
  double restitution;  ///< of the tangential velocity of the centre
  double spin;         ///< [rad/s], negative as published
  double patch_angle_deg;
};

Rebound Strike(const char* tangential, double degrees) {
  const double a = degrees * M_PI / 180, v_t = kSpeed * std::sin(a), v_n = kSpeed * std::cos(a);
  const ContactModel model = Model({.tangential = tangential}, {380e9, 0.23},
                                   {.restitution = kRestitution, .friction = kFriction});
  World world(Cell(model, 0.05, 1e-9),
              Scene({{0.02, 0.025, kRadius, kRadius, 4000, v_t, 0, -v_n}}, {Floor()}));
  const GrainState out = Follow(world).after;
  const double patch = out.v_x - kRadius * out.w_y;
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
      const double v_n = kSpeed * std::cos(degrees * M_PI / 180);
      const double spin = 2.5 * kFriction * (1 + kRestitution) * v_n / kRadius;
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

}  // namespace

Cases ObliqueCases() {
  return {{"oblique_impact", Level::kQuick, PublishedCurve},
          {"oblique_sliding", Level::kQuick, FullSliding},
          {"oblique_rescaled", Level::kQuick, RescaledLaw}};
}

}  // namespace grouser::dem::verify
