#include "surrogate/models/bekker.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "surrogate/models/bekker_constants.h"
#include "surrogate/models/isa.h"

namespace grouser::surrogate {
namespace {

[[noreturn]] void Refuse(const char* name, double value, const char* expected) {
  std::ostringstream text;
  text << "Bekker parameter " << name << ": " << value << ", expected " << expected;
  throw std::invalid_argument(text.str());
}

void CheckModulus(const BekkerParameters& p, double width) {
  if (p.pressure_form == kBekkerForm) {
    const double modulus = p.k_c / width + p.k_phi;
    if (!(modulus > 0)) Refuse("k_c/b + k_phi", modulus, "a positive modulus");
    return;
  }
  if (p.pressure_form != kReeceForm) {
    Refuse("pressure_form", p.pressure_form, "0 (Bekker) or 1 (Reece)");
  }
  const double pressure = p.cohesion * p.reece_k_c + p.unit_weight * width * p.reece_k_phi;
  if (!(pressure > 0)) Refuse("c k_c' + gamma b k_phi'", pressure, "a positive pressure");
}

double EntryAngle(double sinkage, double radius) {
  return 2 * std::asin(std::sqrt(0.5 * sinkage / radius));
}

}  // namespace

BekkerModel::BekkerModel(const BekkerParameters& parameters, const WheelGeometry& wheel)
    : parameters_(parameters), wheel_(wheel) {
  for (const BekkerField& field : BekkerFields()) {
    const double value = parameters.*field.member;
    if (!(value >= field.low && value <= field.high)) {
      std::ostringstream range;
      range << field.low << " to " << field.high << " " << field.unit;
      Refuse(field.name, value, range.str().c_str());
    }
  }
  if (!(wheel.radius_m > 0 && std::isfinite(wheel.radius_m))) {
    Refuse("wheel radius", wheel.radius_m, "a positive length [m]");
  }
  if (!(wheel.width_m > 0 && std::isfinite(wheel.width_m))) {
    Refuse("wheel width", wheel.width_m, "a positive length [m]");
  }
  CheckModulus(parameters, wheel.width_m);
  law_ = bekker::MakeLaw<double>([&](double BekkerParameters::*m) { return parameters.*m; }, wheel);
  RulesOfBekker();  // made before the first answer
}

BekkerModel::Answer BekkerModel::Solve(double v_x, double v_y, double rim_speed,
                                       double load) const noexcept {
  StateBlock block;
  block.v_x[0] = v_x;
  block.v_y[0] = v_y;
  block.rim_speed[0] = rim_speed;
  block.load[0] = load;
  BlockSolverFor(nullptr)(law_, RulesOfBekker(), /*gradients=*/false, 1, &block);
  Answer answer{{}, block.overload[0] != 0, static_cast<int>(block.steps[0]) + 2};
  for (int o = 0; o < kOutputs; ++o) answer.value[o] = block.value[o][0];
  return answer;
}

BekkerModel::Answer BekkerModel::SolveCanonical(const Canonical& state,
                                                double load) const noexcept {
  return Solve(state.forward, state.lateral, state.rim, load);
}

BekkerModel::Answer BekkerModel::AtSinkage(const Canonical& state, double sinkage,
                                           Points points) const noexcept {
  const BekkerRules& rules = RulesOfBekker();
  const auto motion = bekker::MakeMotion(law_, state.forward, state.lateral, state.rim);
  const QuadratureRule& rule = points == Points::kFine ? rules.fine : rules.full;
  const auto f =
      bekker::AllForces(law_, motion, EntryAngle(sinkage, law_.radius), rule, /*sideways=*/true);
  return {{f.of[kFx], f.of[kFy], f.of[kFz], f.of[kTorque], f.of[kMz], sinkage}, false, 1};
}

RimStress BekkerModel::StressAt(const Canonical& state, double sinkage,
                                double angle) const noexcept {
  RimStress stress;
  StressesAt(state, sinkage, {&angle, 1}, {&stress, 1});
  return stress;
}

void BekkerModel::StressesAt(const Canonical& state, double sinkage, std::span<const double> angle,
                             std::span<RimStress> stress) const noexcept {
  const auto motion = bekker::MakeMotion(law_, state.forward, state.lateral, state.rim);
  const auto contact = bekker::MakeContact(law_, motion, EntryAngle(sinkage, law_.radius));
  for (std::size_t i = 0; i < angle.size(); ++i) {
    const auto at = bekker::StressAt(law_, contact, angle[i]);
    stress[i] = {at.normal, at.tangential, at.axial};
  }
}

}  // namespace grouser::surrogate
