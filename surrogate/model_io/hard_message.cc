#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

using HardMessage = v1alpha1::HardGround;

/// Where a field of HardGroundFields stands in the message (bekker_message.cc says why so).
struct HardWire {
  double HardGround::*member;
  bool (HardMessage::*has)() const;
  double (HardMessage::*get)() const;
  void (HardMessage::*set)(double);
};
constexpr HardWire kHardWire[] = {
    {&HardGround::friction, &HardMessage::has_friction, &HardMessage::friction,
     &HardMessage::set_friction},
    {&HardGround::slip_stiffness, &HardMessage::has_slip_stiffness, &HardMessage::slip_stiffness,
     &HardMessage::set_slip_stiffness},
    {&HardGround::rolling_resistance, &HardMessage::has_rolling_resistance,
     &HardMessage::rolling_resistance, &HardMessage::set_rolling_resistance},
    {&HardGround::contact_length_m, &HardMessage::has_contact_length_m,
     &HardMessage::contact_length_m, &HardMessage::set_contact_length_m},
    {&HardGround::contact_width_m, &HardMessage::has_contact_width_m, &HardMessage::contact_width_m,
     &HardMessage::set_contact_width_m},
    {&HardGround::friction_sd, &HardMessage::has_friction_sd, &HardMessage::friction_sd,
     &HardMessage::set_friction_sd},
    {&HardGround::slip_stiffness_sd, &HardMessage::has_slip_stiffness_sd,
     &HardMessage::slip_stiffness_sd, &HardMessage::set_slip_stiffness_sd},
    {&HardGround::rolling_resistance_sd, &HardMessage::has_rolling_resistance_sd,
     &HardMessage::rolling_resistance_sd, &HardMessage::set_rolling_resistance_sd},
};

const HardWire& HardWireOf(const HardGroundField& field) {
  return *std::find_if(std::begin(kHardWire), std::end(kHardWire),
                       [&](const HardWire& w) { return w.member == field.member; });
}

}  // namespace

void SetHard(const HardGround& ground, v1alpha1::Model* model) {
  HardMessage* message = model->mutable_hard();
  message->Clear();
  for (const HardGroundField& field : HardGroundFields()) {
    (message->*HardWireOf(field).set)(ground.*field.member);
  }
}

HardGround ReadHard(const v1alpha1::HardGround& message) {
  HardGround ground;
  HardMessage known;
  for (const HardGroundField& field : HardGroundFields()) {
    const HardWire& wire = HardWireOf(field);
    if ((message.*wire.has)()) {
      ground.*field.member = (message.*wire.get)();
      (known.*wire.set)(ground.*field.member);
    } else if (field.required) {
      throw std::invalid_argument(std::string("hard: no ") + field.name);
    }
  }
  if (known.ByteSizeLong() != message.ByteSizeLong()) {
    throw std::invalid_argument("hard: a parameter that this version does not know");
  }
  return ground;
}

}  // namespace grouser::surrogate
