// Restitution against impact speed, for every law that loses energy.
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

constexpr double kRadius = 0.005, kDensity = 2500;
const Elastic kSoft = {1e8, 0.3};

/// A sphere strikes a rigid wall at `speed`.
double Bounce(const ContactModel& model, double speed, double dt) {
  World world(Cell(model, 0.1, dt),
              Scene({{0.05, 0.05, kRadius, kRadius, kDensity, 0, 0, -speed}}, {Floor()}));
  return Follow(world).after.v_z / speed;
}

double HertzStep(double speed) {
  return ExactHertz(SphereMass(kRadius, kDensity), kRadius, EffectiveModulus(kSoft, {kRigid, 0.3}),
                    speed)
             .contact_s /
         4000;
}

void HertzConstant(Rows& rows) {
  for (const double e : {0.3, 0.5, 0.9}) {
    double worst = e;
    for (const double speed : {0.01, 0.1, 1.0}) {
      const double got = Bounce(Model({}, kSoft, {.restitution = e}), speed, HertzStep(speed));
      if (std::abs(got - e) >= std::abs(worst - e)) worst = got;
    }
    rows.Absolute(Format("hertz_restitution, e %g, worst of 0.01, 0.1, 1 m/s [-]", e), e, worst,
                  0.005, "Tsuji et al. 1992: constant");
  }
}

void LinearConstant(Rows& rows) {
  const double k = 1e5, dt = M_PI * std::sqrt(SphereMass(kRadius, kDensity) / k) / 4000;
  for (const double e : {0.3, 0.9}) {
    double worst = e;
    for (const double speed : {0.01, 1.0}) {
      const Laws laws = {.normal = "linear_spring",
                         .tangential = "linear_history",
                         .settings = {{"linear_spring", "stiffness_n_per_m", k}}};
      const double got = Bounce(Model(laws, kSoft, {.restitution = e}), speed, dt);
      if (std::abs(got - e) >= std::abs(worst - e)) worst = got;
    }
    rows.Absolute(Format("linear_spring, e %g, worst of 0.01, 1 m/s [-]", e), e, worst, 0.005,
                  "damped oscillator, exact");
  }
}

void WaltonBraunConstant(Rows& rows) {
  const double k1 = 1e5;
  for (const double ratio : {1.5, 4.0}) {
    const double dt = M_PI * std::sqrt(SphereMass(kRadius, kDensity) / k1) / 4000;
    for (const double speed : {0.01, 1.0}) {
      const Laws laws = {.normal = "walton_braun",
                         .tangential = "linear_history",
                         .settings = {{"walton_braun", "loading_stiffness_n_per_m", k1},
                                      {"walton_braun", "unloading_stiffness_n_per_m", ratio * k1}}};
      rows.Relative(Format("walton_braun, k2/k1 %g at %g m/s [-]", ratio, speed),
                    std::sqrt(1 / ratio), Bounce(Model(laws, kSoft, {}), speed, dt), 0.002,
                    "Walton & Braun 1986: sqrt(k1/k2)");
    }
  }
}

/// Energy of Thornton's curve: elastic to F_y, straight with 3/2 F_y/a_y
/// beyond; comes back along a Hertz curve of radius R_p.
struct Plastic {
  double e_star, r_eff, mass, yield_n;
  double k() const { return 4.0 / 3.0 * e_star * std::sqrt(r_eff); }
  double yield_m() const { return std::pow(yield_n / k(), 2.0 / 3.0); }
  double yield_speed() const { return std::sqrt(0.8 * yield_n * yield_m() / mass); }
  double Restitution(double speed) const {
    const double work = 0.5 * mass * speed * speed, w_y = 0.4 * yield_n * yield_m();
    if (work <= w_y) return 1;
    const double ky = 1.5 * yield_n / yield_m();
    const double beyond = (std::sqrt(yield_n * yield_n + 2 * ky * (work - w_y)) - yield_n) / ky;
    const double most = yield_n + ky * beyond;
    const double rho = yield_n / most * std::pow((2 * most + yield_n) / (3 * yield_n), 1.5);
    const double back = std::pow(most / (k() * std::sqrt(rho)), 2.0 / 3.0);
    return std::sqrt(0.4 * most * back / work);
  }
};

void ElastoPlasticFalls(Rows& rows) {
  const Elastic steel = {2e10, 0.3};
  const Plastic exact = {EffectiveModulus(steel, {kRigid, 0.3}), kRadius,
                         SphereMass(kRadius, kDensity), 0.05};
  const Laws laws = {.normal = "elasto_plastic",
                     .settings = {{"elasto_plastic", "yield_force_n", exact.yield_n}}};
  const double v_y = exact.yield_speed();
  std::vector<double> got;
  const double times[] = {0.9, 2, 10, 100, 1000};
  for (const double t : times) {
    const double speed = t * v_y;
    const double dt = exact.yield_m() / v_y / 400;  // the contact time hardly changes with speed
    got.push_back(Bounce(Model(laws, steel, {}), speed, dt));
    rows.Relative(Format("elasto_plastic at %g yield speeds [-]", t), exact.Restitution(speed),
                  got.back(), 0.005, "energy of Thornton's curve, exact");
  }
  rows.Absolute("elasto_plastic: d ln e/d ln v from 100 to 1000 yield speeds [-]", -0.25,
                std::log(got[4] / got[3]) / std::log(10.0), 0.01, "Thornton 1997: -1/4");
}

/// A Hertz spring with a dashpot c(overlap), against Runge-Kutta.
template <class Dashpot>
std::vector<double> HertzWith(Rows& rows, const Laws& laws, Dashpot&& c) {
  const double m = SphereMass(kRadius, kDensity), e_star = EffectiveModulus(kSoft, {kRigid, 0.3});
  std::vector<double> out;
  for (const double speed : {0.01, 0.1, 1.0}) {
    const double dt = HertzStep(speed);
    const double exact = ExactRestitution(
        [&](double d, double rate) {
          return 4.0 / 3.0 * e_star * std::sqrt(kRadius * d) * d + c(d) * rate;
        },
        m, speed, 4000 * dt);
    out.push_back(Bounce(Model(laws, kSoft, {}), speed, dt));
    rows.Relative(Format("%s at %g m/s [-]", laws.normal, speed), exact, out.back(), 0.005,
                  "Runge-Kutta in double");
  }
  return out;
}

void OdenMartinsFalls(Rows& rows) {
  const double beta = 1e4;
  const auto e = HertzWith(rows,
                           {.normal = "hertz_oden_martins",
                            .settings = {{"hertz_oden_martins", "damping_kg_per_m_s", beta}}},
                           [&](double d) { return beta * d; });
  rows.AtMost("hertz_oden_martins: largest ratio of restitutions over a tenfold speed [-]", 0.99,
              std::max(e[1] / e[0], e[2] / e[1]), "McCarthy et al. 2010: falls with speed");
}

void DashpotRises(Rows& rows) {
  const double c = 0.5;
  const auto e = HertzWith(
      rows, {.normal = "hertz_dashpot", .settings = {{"hertz_dashpot", "damping_n_s_per_m", c}}},
      [&](double) { return c; });
  rows.AtLeast("hertz_dashpot: least ratio of restitutions over a tenfold speed [-]", 1.01,
               std::min(e[1] / e[0], e[2] / e[1]), "a constant dashpot: rises with speed");
}

}  // namespace

Cases RestitutionCases() {
  return {{"restitution_hertz", Level::kQuick, HertzConstant},
          {"restitution_linear", Level::kQuick, LinearConstant},
          {"restitution_walton_braun", Level::kQuick, WaltonBraunConstant},
          {"restitution_elasto_plastic", Level::kQuick, ElastoPlasticFalls},
          {"restitution_oden_martins", Level::kQuick, OdenMartinsFalls},
          {"restitution_hertz_dashpot", Level::kQuick, DashpotRises}};
}

}  // namespace grouser::dem::verify
