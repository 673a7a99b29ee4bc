#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

using P = BekkerParameters;
using M = v1alpha1::BekkerParameters;

/// Where a parameter of BekkerFields stands in the message. By accessors: the in-process
/// library's messages are "lite" and have no reflection. pressure_form is an enum and apart.
struct WireField {
  double P::*member;
  bool (M::*has)() const;
  double (M::*get)() const;
  void (M::*set)(double);
};
constexpr WireField kWire[] = {
    {&P::n, &M::has_n, &M::n, &M::set_n},
    {&P::k_c, &M::has_k_c_n_per_m_n_plus_1, &M::k_c_n_per_m_n_plus_1, &M::set_k_c_n_per_m_n_plus_1},
    {&P::k_phi, &M::has_k_phi_n_per_m_n_plus_2, &M::k_phi_n_per_m_n_plus_2,
     &M::set_k_phi_n_per_m_n_plus_2},
    {&P::cohesion, &M::has_cohesion_pa, &M::cohesion_pa, &M::set_cohesion_pa},
    {&P::friction_angle, &M::has_friction_angle_rad, &M::friction_angle_rad,
     &M::set_friction_angle_rad},
    {&P::shear_modulus, &M::has_shear_modulus_m, &M::shear_modulus_m, &M::set_shear_modulus_m},
    {&P::c1, &M::has_c1, &M::c1, &M::set_c1},
    {&P::c2, &M::has_c2, &M::c2, &M::set_c2},
    {&P::c3, &M::has_c3, &M::c3, &M::set_c3},
    {&P::sinkage_drive, &M::has_sinkage_drive, &M::sinkage_drive, &M::set_sinkage_drive},
    {&P::sinkage_brake, &M::has_sinkage_brake, &M::sinkage_brake, &M::set_sinkage_brake},
    {&P::sinkage_lateral, &M::has_sinkage_lateral, &M::sinkage_lateral, &M::set_sinkage_lateral},
    {&P::side_passive, &M::has_side_passive, &M::side_passive, &M::set_side_passive},
    {&P::front_passive, &M::has_front_passive, &M::front_passive, &M::set_front_passive},
    {&P::bulldozing_length, &M::has_bulldozing_length_m, &M::bulldozing_length_m,
     &M::set_bulldozing_length_m},
    {&P::turn_speed, &M::has_turn_speed, &M::turn_speed, &M::set_turn_speed},
    {&P::turn_spin, &M::has_turn_spin, &M::turn_spin, &M::set_turn_spin},
    {&P::unit_weight, &M::has_unit_weight_n_per_m3, &M::unit_weight_n_per_m3,
     &M::set_unit_weight_n_per_m3},
    {&P::reece_k_c, &M::has_reece_k_c, &M::reece_k_c, &M::set_reece_k_c},
    {&P::reece_k_phi, &M::has_reece_k_phi, &M::reece_k_phi, &M::set_reece_k_phi},
    {&P::grouser_height, &M::has_grouser_height_m, &M::grouser_height_m, &M::set_grouser_height_m},
    {&P::grouser_share, &M::has_grouser_share, &M::grouser_share, &M::set_grouser_share},
};

const WireField& WireOf(double P::*member) {
  return *std::find_if(std::begin(kWire), std::end(kWire),
                       [&](const WireField& wire) { return wire.member == member; });
}

}  // namespace

void SetBekker(const BekkerParameters& parameters, v1alpha1::Model* model) {
  M* message = model->mutable_bekker();
  for (const WireField& wire : kWire) (message->*wire.set)(parameters.*wire.member);
  message->set_pressure_form(static_cast<v1alpha1::PressureForm>(parameters.pressure_form));
}

BekkerParameters ReadBekker(const v1alpha1::BekkerParameters& message) {
  BekkerParameters parameters;
  M known;
  parameters.pressure_form = message.pressure_form();
  known.set_pressure_form(message.pressure_form());
  for (const BekkerField& field : BekkerFields()) {
    if (field.member == &P::pressure_form) continue;
    const WireField& wire = WireOf(field.member);
    if ((message.*wire.has)()) {
      parameters.*field.member = (message.*wire.get)();
      (known.*wire.set)(parameters.*field.member);
    } else if (!field.optional) {
      throw std::invalid_argument(std::string("bekker: no ") + field.name);
    }
  }
  if (known.ByteSizeLong() != message.ByteSizeLong()) {
    throw std::invalid_argument("bekker: a parameter that this version does not know");
  }
  return parameters;
}

}  // namespace grouser::surrogate
