// Joints, springs and drives of experiment files against closed forms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/scenes/experiment_yaml.h"

namespace grouser::campaign {
namespace {

using ::testing::HasSubstr;
namespace dx = dem::experiment;
using Column = std::vector<double>;

/// One grain in a corner, and what a test adds.
constexpr char kBox[] = R"(name: joints
materials:
  - {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6, poisson_ratio: 0.3}
  - {name: steel, density_kg_per_m3: 8000}
interfaces: {between: [sand, any], restitution: 0.5, friction: 0.5}
box: {length_m: 2, width_m: 2, height_m: 2, material: steel}
grains: {kind: lattice, material: sand, diameter_m: 0.02, count: 1}
output: {sample_s: 0.001}
)";
/// Mass 2 kg; its centre 0.2 m along x from the end at (1, 1, 1); moment 0.03 kg m^2 about y there.
constexpr char kBar[] = R"(bodies:
  - {name: bar, material: steel, parts: {shape: box, size_m: [0.4, 0.02, 0.02]},
     position_m: [1.2, 1, 1], mass_kg: 2, centre_m: [0, 0, 0], inertia_kg_m2: [0.01, 0.03, 0.03]}
)";
constexpr double kMass = 2, kArm = 0.2, kAboutCentre = 0.03, kGravity = 9.81;
constexpr double kAboutEnd = kAboutCentre + kMass * kArm * kArm;

struct Ran {
  dx::Result result;
  std::map<std::string, Column> series;
  const Column& operator[](const std::string& name) const {
    const auto at = series.find(name);
    if (at == series.end()) throw std::out_of_range("no column " + name);
    return at->second;
  }
};

Ran RunText(const std::string& text) {
  const auto file = ReadExperiment(text, "joints.yaml", ".", {}, {});
  Ran out;
  const auto sink = [&](const dx::Table& table, const std::vector<double>& row) {
    for (std::size_t k = 0; k < row.size(); ++k) out.series[table.columns[k]].push_back(row[k]);
  };
  out.result = dx::RunExperiment(file.experiment, sink, nullptr);
  EXPECT_TRUE(out.result.done) << out.result.reason;
  return out;
}

std::string ErrorOf(const std::string& text) {
  try {
    ReadExperiment(text, "joints.yaml", ".", {}, {});
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

double Largest(const Column& c) {
  double out = 0;
  for (const double v : c) out = std::max(out, std::abs(v));
  return out;
}

/// Mean time between upward crossings of a level.
double PeriodOf(const Column& t, const Column& y, double level) {
  Column crossings;
  for (std::size_t k = 1; k < t.size(); ++k) {
    if (y[k - 1] >= level || y[k] < level) continue;
    crossings.push_back(t[k - 1] + (t[k] - t[k - 1]) * (level - y[k - 1]) / (y[k] - y[k - 1]));
  }
  EXPECT_GE(crossings.size(), 2u);
  if (crossings.size() < 2) return NAN;
  return (crossings.back() - crossings.front()) / static_cast<double>(crossings.size() - 1);
}

void ExpectSwings(const Ran& run) {
  // Released level: w^2/2 = m g d/I at the lowest point, T = 4 K(sin 45 deg) sqrt(I/(m g d)).
  const double torque = kMass * kGravity * kArm;
  EXPECT_NEAR(PeriodOf(run["time_s"], run["bar.z_m"], 0.9),
              0.5 * 4 * 1.8540746773013719 * std::sqrt(kAboutEnd / torque), 2e-4)
      << "the height has half the period";
  EXPECT_NEAR(Largest(run["bar.w_y_rad_per_s"]), std::sqrt(2 * torque / kAboutEnd), 5e-3);
  EXPECT_NEAR(Largest(run["pin.f_z_n"]), kMass * (kGravity + kArm * 2 * torque / kAboutEnd), 5e-2);
  EXPECT_LT(Largest(run["pin.gap_m"]), 1e-8);
}

TEST(ExperimentJoints, PendulumOnAHingeSwingsWithItsPeriod) {
  const Ran run = RunText(std::string(kBox) + kBar + R"(duration_s: 3
joints: {name: pin, kind: revolute, child: bar, at_m: [-0.2, 0, 0], axis: [0, 1, 0]}
)");
  ExpectSwings(run);
  // Energy of the coordinate: I w^2/2 = m g d sin(angle).
  const Column &angle = run["pin.angle_rad"], &rate = run["pin.angle_rad_per_s"];
  for (std::size_t k = 100; k < angle.size(); k += 100) {
    // The rate is that of half a step before.
    EXPECT_NEAR(0.5 * kAboutEnd * rate[k] * rate[k], kMass * kGravity * kArm * std::sin(angle[k]),
                0.02);
  }
}

TEST(ExperimentJoints, PendulumOnABallSwingsLikeThatOnAHinge) {
  ExpectSwings(RunText(std::string(kBox) + kBar + R"(duration_s: 3
joints: {name: pin, kind: spherical, child: bar, at_m: [-0.2, 0, 0]}
)"));
}

TEST(ExperimentJoints, SpringAndDamperOnASliderFollowTheirEquation) {
  const double k = 800, c = 8;
  const Ran run = RunText(std::string(kBox) + kBar + R"(duration_s: 4
joints: {name: slide, kind: translational, child: bar, axis: [0, 0, 1]}
springs: {name: leg, kind: linear, body_b: bar, at_a_m: [1.2, 1, 0.5],
          stiffness_n_per_m: 800, damping_n_s_per_m: 8}
)");
  // m z'' + c z' + k z = -m g from rest at the free length.
  const double decay = 0.5 * c / kMass, w = std::sqrt(k / kMass - decay * decay),
               deep = kMass * kGravity / k;
  const Column &t = run["time_s"], &z = run["slide.way_m"];
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double free =
        std::exp(-decay * t[i]) * (std::cos(w * t[i]) + decay / w * std::sin(w * t[i]));
    ASSERT_NEAR(z[i], deep * (free - 1), 1e-3 * deep) << t[i];
  }
  EXPECT_NEAR(run["leg.force_n"].back(), -kMass * kGravity, 0.01 * kMass * kGravity);
  EXPECT_NEAR(run["leg.length_m"].back(), 0.5 - deep, 0.01 * deep);
  EXPECT_LT(Largest(run["slide.gap_m"]), 1e-8);
  EXPECT_LT(Largest(run["bar.turned_y_rad"]), 1e-9);
}

TEST(ExperimentJoints, StiffSpringsAndDampersShortenTheStep) {
  const auto steps = [](const std::string& keys) {
    const auto file = ReadExperiment(std::string(kBox) + kBar + R"(duration_s: 1
joints: {name: slide, kind: translational, child: bar, axis: [0, 0, 1]}
springs: {name: leg, kind: linear, body_b: bar, at_a_m: [1.2, 1, 0.5], )" +
                                         keys + "}\n",
                                     "joints.yaml", ".", {}, {});
    const dx::Plan plan = dx::PlanOf(file.experiment, {});
    return std::pair(plan.dt_s, plan.program_dt_s);
  };
  const auto [dt, soft] = steps("stiffness_n_per_m: 10");
  EXPECT_EQ(soft, dt);
  // A tenth of sqrt(m/k), a fifth of m/c.
  EXPECT_NEAR(steps("stiffness_n_per_m: 8.0e6").second, 0.1 * std::sqrt(kMass / 8e6), 1e-12);
  EXPECT_NEAR(steps("damping_n_s_per_m: 8000").second, 0.2 * kMass / 8000, 1e-12);
}

TEST(ExperimentJoints, RotationalSpringTurnsAFlywheel) {
  const Ran run = RunText(std::string(kBox) + kBar + R"(gravity_m_per_s2: 0
duration_s: 2
joints: {name: pin, kind: revolute, child: bar, axis: [0, 1, 0]}
springs: {name: coil, kind: rotational, joint: pin, stiffness_n_m_per_rad: 1.2, free_angle_deg: 30,
          torque: {torque_n_m: 0.6}}
)");
  // I q'' = -k (q - q_0) + T from rest at 0.
  const double w = std::sqrt(1.2 / kAboutCentre), middle = M_PI / 6 + 0.6 / 1.2;
  const Column &t = run["time_s"], &q = run["pin.angle_rad"];
  for (std::size_t i = 0; i < t.size(); ++i) {
    ASSERT_NEAR(q[i], middle * (1 - std::cos(w * t[i])), 1e-3 * middle) << t[i];
  }
  EXPECT_NEAR(run["bar.turned_y_rad"].back(), q.back(), 1e-6) << "the pose counts the same turn";
}

TEST(ExperimentJoints, DrivenHingeTurnsStopsAndHoldsTheBar) {
  const Ran run = RunText(std::string(kBox) + kBar + R"(gravity_m_per_s2: 0
duration_s: 1.5
joints:
  name: pin
  kind: revolute
  child: bar
  at_m: [-0.2, 0, 0]
  axis: [0, 0, 1]
  drive:
    - {rate_deg_per_s: 360, ramp_s: 0.2, for_s: 1}
    - {rate_deg_per_s: 0, ramp_s: 0.2}
)");
  // Ramps go half the way of the full rate.
  EXPECT_NEAR(run["pin.angle_rad"].back(), 2 * M_PI, 2e-3 * M_PI);
  EXPECT_LT(std::abs(run["pin.angle_rad_per_s"].back()), 1e-9);
  const Column &t = run["time_s"], &x = run["pin.f_x_n"], &y = run["pin.f_y_n"];
  const double pull = kMass * kArm * 4 * M_PI * M_PI;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (t[i] < 0.3 || t[i] > 0.95) continue;
    ASSERT_NEAR(std::hypot(x[i], y[i]), pull, 1e-3 * pull) << t[i];
  }
  EXPECT_LT(Largest(run["pin.gap_m"]), 1e-8);
}

TEST(ExperimentJoints, ADriveThatIsTooFastIsRefused) {
  const std::string error = ErrorOf(std::string(kBox) + kBar + R"(duration_s: 1
joints: {name: pin, kind: revolute, child: bar, at_m: [-0.2, 0, 0], axis: [0, 0, 1],
         drive: {rate_deg_per_s: 1.0e+9, for_s: 1}}
)");
  EXPECT_NE(error.find("joints[0].drive"), std::string::npos) << error;
  EXPECT_NE(error.find("in a time step"), std::string::npos) << error;
}

TEST(ExperimentJoints, ABlockOnASliderRestsOnAGrain) {
  const Ran run = RunText(std::string(kBox) + R"(duration_s: 1
bodies:
  - {name: block, material: steel, parts: {shape: box, size_m: [0.1, 0.1, 0.02]},
     position_m: [0.0102, 0.0102, 0.032], mass_kg: 0.05}
joints: {name: slide, kind: translational, child: block, axis: [0, 0, 1]}
probes: [{kind: wrench, body: block}, {kind: joint, joint: slide}]
)");
  EXPECT_NEAR(run["block.f_z_n"].back(), 0.05 * kGravity, 1e-3 * 0.05 * kGravity);
  EXPECT_NEAR(run["slide.f_z_n"].back(), 0, 1e-9) << "a slide takes up nothing along its axis";
  EXPECT_LT(Largest(run["slide.gap_m"]), 1e-8);
}

TEST(ExperimentJoints, RefusesWhatCannotBe) {
  const std::string start = std::string(kBox) + kBar + "duration_s: 1\n";
  const auto joint = [&](const std::string& keys) {
    return ErrorOf(start + "joints: {" + keys + "}\n");
  };
  EXPECT_THAT(joint("name: pin, kind: revolute, child: rod"),
              HasSubstr("'rod', expected that of a body"));
  EXPECT_THAT(joint("name: pin, kind: revolute, child: bar, parent: bar"),
              HasSubstr("which is the child"));
  EXPECT_THAT(joint("name: bar, kind: revolute, child: bar"), HasSubstr("a name of its own"));
  EXPECT_THAT(joint("name: pin, kind: revolute, child: bar, axis: [0, 0, 0]"), HasSubstr("axis"));
  EXPECT_THAT(joint("name: pin, kind: hinge, child: bar"), HasSubstr("one of: revolute"));
  EXPECT_THAT(joint("name: pin, kind: spherical, child: bar, locked: on"), HasSubstr("locked"));
  EXPECT_THAT(joint("name: pin, kind: revolute, child: bar, drive: {speed_m_per_s: 1}"),
              HasSubstr("rate_deg_per_s"));
  EXPECT_THAT(
      joint("name: pin, kind: revolute, child: bar, locked: on, drive: {rate_deg_per_s: 1}"),
      HasSubstr("one of them"));
  EXPECT_THAT(ErrorOf(start + "springs: {name: s, kind: rotational, joint: pin}\n"),
              HasSubstr("a revolute joint"));
  EXPECT_THAT(
      ErrorOf(start + "springs: {name: s, kind: linear, body_b: bar, at_a_m: [1.2, 1, 0.5], "
                      "stiffness_n_per_m: -1}\n"),
      HasSubstr("stiffness"));
  EXPECT_THAT(ErrorOf(start + "joints: {name: pin, kind: revolute, child: bar}\n"
                              "probes: {kind: joint, joint: pim}\n"),
              HasSubstr("the name of a joint"));
  EXPECT_EQ(joint("name: pin, kind: revolute, child: bar"), "accepted");
}

}  // namespace
}  // namespace grouser::campaign
