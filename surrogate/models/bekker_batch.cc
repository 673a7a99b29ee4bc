#include "surrogate/models/bekker_batch.h"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <numbers>

#include "surrogate/models/bekker.h"
#include "surrogate/models/quadrature.h"

namespace grouser::surrogate {

namespace lanes_baseline {
void SolveBlock(const LaneModel& a, bool gradients, StateBlock* block) noexcept;
}
#if defined(__x86_64__)
namespace lanes_avx2 {
void SolveBlock(const LaneModel& a, bool gradients, StateBlock* block) noexcept;
}
namespace lanes_avx512 {
void SolveBlock(const LaneModel& a, bool gradients, StateBlock* block) noexcept;
}
#endif

namespace {

// ln of F_z/z^(n + 1/2): F_z of a uniform profile is c b k z^n sqrt(2 r z).
constexpr double kProfile = 0.7;

BlockSolver Best() {
  const char* wish = std::getenv("GROUSER_ISA");  // lowers the set, in tests
  for (const char* set : {"avx512", "avx2", "baseline"}) {
    if (wish != nullptr && std::strcmp(wish, "avx512") != 0 && std::strcmp(wish, set) != 0) {
      continue;
    }
    if (const BlockSolver solver = BlockSolverFor(set)) return solver;
  }
  return lanes_baseline::SolveBlock;
}

bool Usable(const BekkerBatch& batch, std::size_t i) {
  return std::isfinite(batch.v_x[i]) && std::isfinite(batch.v_y[i]) &&
         std::isfinite(batch.rim_speed[i]) && std::isfinite(batch.load[i]) && batch.load[i] > 0;
}

// Unusable states and lanes beyond the end get a harmless one.
void Pack(const BekkerBatch& batch, std::size_t first, int count, StateBlock* block) {
  for (int l = 0; l < kBlock; ++l) {
    const bool usable = l < count && Usable(batch, first + l);
    block->v_x[l] = usable ? batch.v_x[first + l] : 1;
    block->v_y[l] = usable ? batch.v_y[first + l] : 0;
    block->rim_speed[l] = usable ? batch.rim_speed[first + l] : 1;
    block->load[l] = usable ? batch.load[first + l] : 1;
  }
}

void Unpack(const StateBlock& block, std::size_t first, int count, const BekkerBatch& batch) {
  const auto copy = [&](const std::span<double>& to, const double* from) {
    if (to.empty()) return;
    for (int l = 0; l < count; ++l) to[first + l] = from[l];
  };
  for (int o = 0; o < kOutputs; ++o) {
    copy(batch.value[o], block.value[o]);
    for (int i = 0; i < kInputs; ++i) copy(batch.gradient[o][i], block.gradient[o][i]);
  }
  for (int l = 0; l < count; ++l) {
    if (!batch.no_equilibrium.empty()) batch.no_equilibrium[first + l] = block.overload[l] != 0;
    if (Usable(batch, first + l)) continue;
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    for (int o = 0; o < kOutputs; ++o) {
      if (!batch.value[o].empty()) batch.value[o][first + l] = kNaN;
      for (const std::span<double>& g : batch.gradient[o]) {
        if (!g.empty()) g[first + l] = kNaN;
      }
    }
  }
}

// Graded Gauss rules, which outlive every model.
template <int N>
LaneRule Rule() {
  static const GaussRule<N> rule = GradedGauss<N>();
  return {N, rule.node.data(), rule.weight.data()};
}

// The shorter the shear, the steeper its stress within the contact.
LaneRule RuleFor(double shear_over_radius) {
  if (shear_over_radius >= 0.4) return Rule<6>();
  if (shear_over_radius >= 0.08) return Rule<8>();
  return shear_over_radius >= 0.02 ? Rule<12>() : Rule<16>();
}

}  // namespace

BlockSolver BlockSolverFor(const char* set) noexcept {
  if (set == nullptr) {
    static const BlockSolver best = Best();
    return best;
  }
#if defined(__x86_64__)
  if (std::strcmp(set, "avx512") == 0 && __builtin_cpu_supports("avx512f") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
    return lanes_avx512::SolveBlock;
  }
  if (std::strcmp(set, "avx2") == 0 && __builtin_cpu_supports("avx2")) {
    return lanes_avx2::SolveBlock;
  }
#endif
  return std::strcmp(set, "baseline") == 0 ? lanes_baseline::SolveBlock : nullptr;
}

LaneModel MakeLaneModel(const BekkerModel& model) noexcept {
  const BekkerParameters& p = model.parameters();
  LaneModel m{};
  m.radius = model.wheel().radius_m;
  m.width = model.wheel().width_m;
  m.rule = RuleFor(p.shear_modulus / m.radius);
  m.first_rules = {Rule<4>(), Rule<6>()};
  m.theta_max = 2 * std::asin(std::sqrt(0.5 * model.max_sinkage() / m.radius));
  m.log_modulus = std::log(model.modulus());
  m.n = p.n;
  m.log_guess = std::log(kProfile * m.width * std::sqrt(2 * m.radius)) + m.log_modulus;
  m.cohesion = p.cohesion;
  m.inv_cohesion = p.cohesion > 0 ? 1 / p.cohesion : 0;
  m.friction = std::tan(p.friction_angle);
  m.inv_shear = 1 / p.shear_modulus;
  m.inv_bulldozing = 1 / p.bulldozing_length;
  m.shear_over_bulldozing = p.shear_modulus / p.bulldozing_length;
  m.c1 = p.c1;
  m.c2 = p.c2;
  m.c3 = p.c3;
  m.sinkage_drive = p.sinkage_drive;
  m.sinkage_brake = p.sinkage_brake;
  m.sinkage_lateral = p.sinkage_lateral;
  m.turn_spin = p.turn_spin;
  m.inv_turn_speed = 1 / p.turn_speed;
  m.side_square = 0.5 * p.unit_weight * p.side_passive;
  m.side_linear = 2 * p.cohesion * std::sqrt(p.side_passive);
  m.front_square = 0.5 * p.unit_weight * p.front_passive;
  m.front_linear = 2 * p.cohesion * std::sqrt(p.front_passive);
  m.traction = model.shear_radius_ratio();
  return m;
}

void BekkerModel::SolveBatch(const BekkerBatch& batch) const noexcept {
  bool gradients = false;
  for (const auto& of_output : batch.gradient) {
    for (const std::span<double>& g : of_output) gradients |= !g.empty();
  }
  const BlockSolver solve = BlockSolverFor(nullptr);
  StateBlock block;
  const std::size_t n = batch.load.size();
  for (std::size_t first = 0; first < n; first += kBlock) {
    const int count = n - first < kBlock ? static_cast<int>(n - first) : kBlock;
    Pack(batch, first, count, &block);
    solve(lanes_, gradients, &block);
    Unpack(block, first, count, batch);
  }
}

}  // namespace grouser::surrogate
