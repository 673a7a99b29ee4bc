// The box is turned over and over to mix its grains.
#include <cmath>
#include <stdexcept>

#include "dem_offline/engine/experiment/ground.h"
#include "dem_offline/engine/experiment/plan.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kOpenLid = 1.9;    // of the box's height: out of the way
constexpr double kMostSwirl = 0.1;  // centrifugal over gravity, which is left out

}  // namespace

bool IsTurned(const Experiment& e) {
  for (const Preparation& p : e.preparation) {
    if (p.kind == Preparation::Kind::kTurn) return true;
  }
  return false;
}

void CheckTurn(const Experiment& e, const std::string& at, const Preparation& p) {
  CheckPositive(at + ".rate_deg_per_s", p.rate_rad_per_s);
  CheckWithin(at + ".turns", p.turns, 1, 1000);
  CheckWithin(at + ".height_m", p.height_m, 2 * LargestDiameter(e), e.box.height_m);
  if (e.box.x != Side::kWall || e.box.y != Side::kWall || e.box.planar) {
    throw SpecError(at + ".do", "turn of a box without walls", "x: wall and y: wall, not planar");
  }
  const double side = p.about_x ? e.box.width_m : e.box.length_m;
  const double reach = 0.5 * std::hypot(side, p.height_m);
  const double most = std::sqrt(kMostSwirl * e.gravity_m_per_s2 / reach);
  if (p.rate_rad_per_s > most) {
    throw SpecError(at + ".rate_deg_per_s", Short(p.rate_rad_per_s * 180 / M_PI),
                    "at most " + Short(most * 180 / M_PI) +
                        ", where what is left out, the centrifugal force, is a tenth of gravity");
  }
}

/// Above the box, where no grain comes; Turn closes it.
void Ground::AddLid() {
  const double down[3] = {0, 0, -1};
  Body lid;
  lid.shape = HalfSpace(down);
  lid.material = MaterialNumber(e_, e_.box.material, "box.material");
  lid.position_m = {0, 0, kOpenLid * e_.box.height_m};
  lid_ = world_->AddBody(lid);
  ++walls_;
}

void Ground::Turn(const Preparation& p) {
  for (std::int64_t i = 0; i < world_->count(); ++i) {
    const GrainState s = world_->State(i);
    if (s.z_m + s.radius_m <= p.height_m) continue;
    throw std::runtime_error("preparation (turn): a grain reaches " + Short(s.z_m + s.radius_m) +
                             " m, above the lid of the box at " + Short(p.height_m) + " m");
  }
  world_->body(lid_).position_m[2] = p.height_m;
  const double angle = 2 * M_PI * p.turns;
  const auto steps = static_cast<std::int64_t>(std::ceil(angle / p.rate_rad_per_s / dt_));
  const double g = e_.gravity_m_per_s2;
  for (std::int64_t s = 0; s < steps; ++s) {
    const double a = angle * static_cast<double>(s + 1) / static_cast<double>(steps);
    Vec3d gravity = {0, 0, -g * std::cos(a)};
    gravity[p.about_x ? 1 : 0] = g * std::sin(a);
    if (s + 1 == steps) gravity = {0, 0, -g};
    world_->SetGravity(gravity);
    Step("turn");
  }
  world_->body(lid_).position_m[2] = kOpenLid * e_.box.height_m;
}

}  // namespace grouser::dem::experiment
