// The kernels of the solver: derivatives against differences, steps against their equations, and
// every instruction set against the others, bit by bit.
#include "surrogate/vehicle/pack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <random>

#include "surrogate/vehicle/mechanics.h"
#include "tests/unit/vehicle/vehicles.h"

namespace grouser::vehicle {
namespace {

using pack::kLanes;
using surrogate::kFx, surrogate::kFy, surrogate::kTorque, surrogate::kMz;

/// Sixteen random motions of a vehicle, on hard ground.
class Motions {
 public:
  Motions(const Vehicle& vehicle, Motion::Given given)
      : mechanics_(vehicle),
        body_(mechanics_.Body()),
        unknowns_(Mechanics::UnknownsOf(mechanics_.layout(given))),
        model_(testing::WithFriction(0.6), vehicle.wheel_types[0].radius_m),
        lanes_(std::make_unique<pack::Lanes>()) {
    std::mt19937 random(3);
    const auto draw = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    pack::Lanes& s = *lanes_;
    const double weight = vehicle.mass_kg * vehicle.gravity_m_per_s2;
    for (int l = 0; l < kLanes; ++l) {
      s.v_x[l] = draw(0.5, 2);
      s.yaw[l] = draw(-0.5, 0.5);
      s.speed[l] = s.v_x[l];
      s.load[l] = weight * draw(0.9, 1);
      s.gravity_x[l] = draw(-1, 1);
      s.gravity_y[l] = draw(-1, 1);
      s.acceleration[l] = draw(-1, 1);
      s.yaw_up[l] = draw(-0.2, 0.2);
      s.steering[l] = draw(-0.3, 0.3);
      for (auto& rim : s.rim_given) rim[l] = draw(0.5, 2);
      for (int k = 0; k < unknowns_.size; ++k) {
        s.at[k][l] = draw(0.5, 2);
        s.unit[k][l] = s.speed[l];
      }
      s.at[0][l] = draw(-0.2, 0.2);
      s.at[unknowns_.moment][l] = draw(-0.05, 0.05) * weight;
      s.unit[unknowns_.moment][l] = weight * 0.1;
      if (unknowns_.psi >= 0) s.at[unknowns_.psi][l] = draw(-0.3, 0.3);
      if (unknowns_.psi >= 0) s.unit[unknowns_.psi][l] = 1;
      if (unknowns_.yaw >= 0) s.at[unknowns_.yaw][l] = draw(-0.5, 0.5);
    }
  }

  /// One evaluation at what stands in `at`; models tell no derivative by the yaw rate, which is
  /// left out here.
  void Weigh(const pack::Kernel& kernel) {
    pack::Lanes& s = *lanes_;
    for (int l = 0; l < kLanes; ++l) {
      const double psi = unknowns_.psi >= 0 ? s.at[unknowns_.psi][l] : s.steering[l];
      s.psi_cos[l] = std::cos(psi);
      s.psi_sin[l] = std::sin(psi);
    }
    kernel.place(body_, unknowns_, kLanes, &s);
    for (std::size_t i = 0; i < mechanics_.wheels(); ++i) {
      const auto in = [&](const pack::PerLane* row) {
        return std::span<const double>(row[i], kLanes);
      };
      surrogate::WheelStatesView states{
          in(s.placed.v_x), in(s.placed.v_y), in(s.placed.rim), in(s.placed.load), {}, {}, {}, {}};
      surrogate::ResponsesView out;
      const surrogate::Output outputs[4] = {kFx, kFy, kTorque, kMz};
      for (std::size_t o = 0; o < 4; ++o) {
        surrogate::OutputView& to = out.output[outputs[o]];
        const auto part = [&](std::size_t p) { return std::span(s.felt.part[o][p][i]); };
        to.value = part(0);
        to.d_v_x = part(1);
        to.d_v_y = part(2);
        to.d_rim_speed = part(3);
        to.d_load = part(4);
        if (o < 3) to.high = s.felt.high[o][i];
      }
      out.output[surrogate::kSinkage].value = s.felt.sinkage[i];
      std::uint32_t flags[kLanes];
      out.flags = flags;
      model_.Evaluate(states, out);
    }
    kernel.weigh(body_, unknowns_, kLanes, &s);
  }

  /// A whole round: linearised, solved and moved, by a set.
  void Round(const pack::Kernel& kernel) {
    Weigh(kernel);
    for (int l = 0; l < kLanes; ++l) {
      lanes_->going[l] = lanes_->solving[l] = lanes_->stepping[l] = lanes_->moving[l] = -1;
      lanes_->share[l] = l % 3 == 0 ? 0.5 : 1;
    }
    kernel.linearise(body_, unknowns_, kLanes, lanes_.get());
    if (pack::Solves(unknowns_.size)) kernel.solve(body_, unknowns_, kLanes, lanes_.get());
    kernel.move(body_, unknowns_, kLanes, lanes_.get());
  }

  pack::Lanes& lanes() { return *lanes_; }
  const pack::Unknowns& unknowns() const { return unknowns_; }

 private:
  Mechanics mechanics_;
  pack::Body body_;
  pack::Unknowns unknowns_;
  surrogate::HardGroundModel model_;
  std::unique_ptr<pack::Lanes> lanes_;
};

struct Case {
  Vehicle vehicle;
  Motion::Given given;
};
std::vector<Case> Cases() {
  const auto twist = Motion::Given::kTwist, controls = Motion::Given::kControls;
  return {{testing::Skid(), twist},
          {testing::Cart(), twist},
          {testing::Cart(Coupling::kLocked), twist},
          {testing::Rover(), twist},
          {testing::Skid(), controls},
          {testing::Cart(), controls}};
}

TEST(Pack, DerivativesAreThoseOfDifferences) {
  for (const Case& c : Cases()) {
    Motions base(c.vehicle, c.given);
    const pack::Kernel& kernel = *pack::KernelFor(nullptr);
    base.Weigh(kernel);
    const int n = base.unknowns().size;
    for (int k = 0; k < n; ++k) {
      Motions up(c.vehicle, c.given), down(c.vehicle, c.given);
      const double h = 1e-6;
      for (int l = 0; l < kLanes; ++l) {
        up.lanes().at[k][l] += h * up.lanes().unit[k][l];
        down.lanes().at[k][l] -= h * down.lanes().unit[k][l];
      }
      up.Weigh(kernel);
      down.Weigh(kernel);
      for (int i = 0; i < n; ++i) {
        for (int l = 0; l < kLanes; ++l) {
          if (base.lanes().rare[l] != 0) continue;
          const double slope = (up.lanes().tried[i][l] - down.lanes().tried[i][l]) / (2 * h);
          EXPECT_NEAR(base.lanes().fresh[i][k][l], slope, 2e-6 * (1 + std::fabs(slope)))
              << c.vehicle.name << " row " << i << " unknown " << k << " lane " << l;
        }
      }
    }
  }
}

TEST(Pack, StepsSolveTheirEquations) {
  for (const Case& c : {Cases()[0], Cases()[1]}) {  // 4 and 8 unknowns
    Motions m(c.vehicle, c.given);
    m.Weigh(*pack::KernelFor(nullptr));
    pack::Lanes& s = m.lanes();
    for (int l = 0; l < kLanes; ++l) s.going[l] = s.begins[l] = s.solving[l] = -1;
    const pack::Kernel& kernel = *pack::KernelFor(nullptr);
    kernel.linearise({}, m.unknowns(), kLanes, &s);
    for (int k = 0; k < m.unknowns().size; ++k) s.jacobian[k][1][5] = 0;  // singular
    kernel.solve({}, m.unknowns(), kLanes, &s);
    for (int l = 0; l < kLanes; ++l) {
      EXPECT_EQ(s.solved[l] != 0, l != 5) << l;
      if (l == 5) continue;
      for (int i = 0; i < m.unknowns().size; ++i) {
        double left = s.residual[i][l];
        for (int k = 0; k < m.unknowns().size; ++k) left -= s.jacobian[i][k][l] * s.step[k][l];
        EXPECT_NEAR(left, 0, 1e-9) << l;
      }
    }
  }
}

TEST(Pack, EveryInstructionSetGivesTheSameBits) {
  for (const Case& c : Cases()) {
    std::unique_ptr<Motions> first;
    for (const char* isa : {"baseline", "avx2", "avx512"}) {
      const pack::Kernel* kernel = pack::KernelFor(isa);
      if (kernel == nullptr) continue;
      auto m = std::make_unique<Motions>(c.vehicle, c.given);
      for (int l = 0; l < kLanes; ++l) m->lanes().sds[l] = l % 2;
      for (int round = 0; round < 3; ++round) {
        for (int l = 0; l < kLanes; ++l) m->lanes().begins[l] = round == 0 ? -1 : 0;
        m->Round(*kernel);
      }
      if (first == nullptr) {
        first = std::move(m);
        continue;
      }
      EXPECT_EQ(std::memcmp(&m->lanes(), &first->lanes(), sizeof(pack::Lanes)), 0)
          << c.vehicle.name << " " << isa;
    }
  }
}

}  // namespace
}  // namespace grouser::vehicle
